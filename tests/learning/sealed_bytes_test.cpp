#include "learning/nn/sealed_bytes.hpp"

#include <catch2/catch.hpp>

using namespace stairwell;

TEST_CASE("a sealed file says what is wrong with it", "[sealed]") {
  using Catch::Contains;
  const std::string bytes = nn::seal("kind 1", "settings", "the payload");
  CHECK(nn::unseal(bytes, "kind 1", "settings") == "the payload");
  CHECK_THROWS_WITH(nn::unseal(bytes, "kind 2", "settings"), Contains("not a file of kind 'kind 2'"));
  CHECK_THROWS_WITH(nn::unseal(bytes, "kind 1", "others"), Contains("'settings' where 'others'"));
  CHECK_THROWS_WITH(nn::unseal(bytes.substr(0, bytes.size() - 1), "kind 1", "settings"), "truncated");
  CHECK_THROWS_WITH(nn::unseal(bytes + "x", "kind 1", "settings"), "too long");
  for (std::size_t i = bytes.size() - 11; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 1);
    CHECK_THROWS_WITH(nn::unseal(damaged, "kind 1", "settings"), "damaged");
  }
  nn::ByteWriter writer;
  writer.number<std::uint64_t>(std::uint64_t{1} << 62);  // a list that would be longer than the file
  nn::ByteReader reader(writer.bytes());
  CHECK_THROWS_WITH(reader.list<float>(), "truncated");
}
