#include "apps/byte_codec.hpp"
#include "apps/replay_file.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "tests/test_folder.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

namespace stairwell::apps {
namespace {

namespace fs = std::filesystem;

fs::path put(const std::string& name, const std::string& bytes) {
  const fs::path file = testing::test_folder() / name;
  std::ofstream(file, std::ios::binary) << bytes;
  return file;
}

}  // namespace

TEST_CASE("numbers come back as they were written") {
  Rng rng = make_rng(1, "codec");
  std::uniform_int_distribution<int> width(0, 63);
  std::uniform_int_distribution<std::uint64_t> any;
  std::vector<std::uint64_t> values{0, 127, 128, std::numeric_limits<std::uint64_t>::max()};
  for (int i = 0; i < 1000; ++i) values.push_back(any(rng) >> width(rng));
  std::string bytes;
  for (const std::uint64_t value : values) {
    put_varint(bytes, value);
    put_signed(bytes, static_cast<std::int64_t>(value));
    put_u32(bytes, static_cast<std::uint32_t>(value));
  }
  ByteReader reader(bytes);
  for (const std::uint64_t value : values) {
    REQUIRE(reader.varint() == value);
    REQUIRE(reader.signed_varint() == static_cast<std::int64_t>(value));
    REQUIRE(reader.u32() == static_cast<std::uint32_t>(value));
  }
  CHECK(reader.done());
  CHECK_THROWS_AS(reader.varint(), InputError);
  CHECK_THROWS_AS(ByteReader(std::string(11, '\xFF')).varint(), InputError);
}

TEST_CASE("published values of the codecs") {
  CHECK(crc32_of("123456789") == 0xCBF43926);  // the check value of CRC-32/ISO-HDLC
  CHECK(base64("") == "");
  CHECK(base64("f") == "Zg==");  // RFC 4648, section 10
  CHECK(base64("fo") == "Zm8=");
  CHECK(base64("foobar") == "Zm9vYmFy");
}

TEST_CASE("cells and voxels name each other") {
  const CellOrder order{{5, 7, 11}};
  std::uint64_t cell = 0;
  for (int x = 0; x < 5; ++x)
    for (int y = 0; y < 7; ++y)
      for (int z = 0; z < 11; ++z, ++cell) {
        REQUIRE(order.cell({x, y, z}) == cell);
        REQUIRE(order.voxel(cell) == VoxelIndex{x, y, z});
      }
}

TEST_CASE("a replay file gives its records back, and damage anywhere is found") {
  std::string header, rest;
  put_record(header, ReplayRecord::kHeader, "{}");
  put_record(rest, ReplayRecord::kVoxels, std::string(300, 'v'));
  put_record(rest, ReplayRecord::kPlan, "p");
  const std::string whole = std::string(kReplayMagic) + replay_chunk(header) + replay_chunk(rest);
  CHECK(read_replay(put("replay.bin", whole)) == header + rest);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    CAPTURE(i);
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x20);
    CHECK_THROWS_AS(read_replay(put("damaged.bin", damaged)), InputError);
  }
  const std::size_t first = kReplayMagic.size() + replay_chunk(header).size();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    if (length == first) continue;  // a whole chunk is missing: a run that was killed
    CAPTURE(length);
    CHECK_THROWS_AS(read_replay(put("short.bin", whole.substr(0, length))), InputError);
  }
}

}  // namespace stairwell::apps
