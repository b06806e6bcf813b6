#include "apps/replay_file.hpp"

#include "apps/byte_codec.hpp"
#include "apps/csv_table.hpp"
#include "core/errors.hpp"

namespace stairwell::apps {

VoxelIndex CellOrder::voxel(std::uint64_t cell) const {
  const auto sy = static_cast<std::uint64_t>(size[1]), sz = static_cast<std::uint64_t>(size[2]);
  return {static_cast<int>(cell / (sy * sz)), static_cast<int>(cell / sz % sy), static_cast<int>(cell % sz)};
}

void put_cells(std::string& bytes, const std::vector<std::uint64_t>& cells) {
  put_varint(bytes, cells.size());
  std::uint64_t last = 0;
  for (const std::uint64_t cell : cells) {
    put_varint(bytes, cell - last);
    last = cell;
  }
}

void put_record(std::string& records, ReplayRecord kind, std::string_view payload) {
  records += static_cast<char>(kind);
  put_varint(records, payload.size());
  records += payload;
}

std::string replay_chunk(std::string_view records) {
  std::string chunk;
  put_u32(chunk, static_cast<std::uint32_t>(records.size()));
  put_u32(chunk, crc32_of(records));
  chunk += records;
  return chunk;
}

std::string read_replay(const std::filesystem::path& file) {
  const std::string bytes = read_whole_file(file);
  if (!bytes.starts_with(kReplayMagic)) throw InputError(file.string() + ": is not a replay of this version");
  ByteReader reader(std::string_view(bytes).substr(kReplayMagic.size()));
  std::string records;
  try {
    while (!reader.done()) {
      const std::uint32_t size = reader.u32(), crc = reader.u32();
      const std::string_view chunk = reader.take(size);
      if (crc32_of(chunk) != crc) throw InputError("a checksum differs");
      records += chunk;
    }
    for_each_record(records, [](ReplayRecord, std::string_view) {});
  } catch (const InputError& error) {
    throw InputError(file.string() + ": the replay is damaged (" + error.what() + "): make the run again");
  }
  if (!records.starts_with(static_cast<char>(ReplayRecord::kHeader))) {
    throw InputError(file.string() + ": has no header");
  }
  return records;
}

void for_each_record(std::string_view records, const std::function<void(ReplayRecord, std::string_view)>& visit) {
  ByteReader reader(records);
  while (!reader.done()) {
    const auto kind = static_cast<ReplayRecord>(reader.byte());
    visit(kind, reader.take(reader.varint()));
  }
}

}  // namespace stairwell::apps
