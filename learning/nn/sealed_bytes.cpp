#include "learning/nn/sealed_bytes.hpp"

#include "core/errors.hpp"
#include "learning/nn/model_file.hpp"

#include <sstream>

namespace stairwell::nn {

namespace {

std::string_view take_line(std::string_view& bytes) {
  const std::size_t end = bytes.find('\n');
  if (end == std::string_view::npos) throw InputError("truncated");
  const std::string_view line = bytes.substr(0, end);
  bytes.remove_prefix(end + 1);
  return line;
}

}  // namespace

std::string_view ByteReader::take(std::uint64_t count, std::size_t size) {
  if (count > left_.size() / size) throw InputError("truncated");
  const std::string_view taken = left_.substr(0, static_cast<std::size_t>(count) * size);
  left_.remove_prefix(taken.size());
  return taken;
}

void ByteReader::finish() const {
  if (!left_.empty()) throw InputError("too long");
}

std::string seal(std::string_view kind, std::string_view settings, std::string_view payload) {
  std::ostringstream out;
  out << kind << "\n" << settings << "\n" << payload.size() << ' ' << fnv1a64(payload) << "\n" << payload;
  return std::move(out).str();
}

std::string_view unseal(std::string_view bytes, std::string_view kind, std::string_view settings) {
  if (!bytes.starts_with(kind) || bytes.substr(kind.size(), 1) != "\n") {
    throw InputError("not a file of kind '" + std::string(kind) + "'");
  }
  take_line(bytes);
  if (const std::string_view mine = take_line(bytes); mine != settings) {
    throw InputError("of another training: '" + std::string(mine) + "' where '" + std::string(settings) +
                     "' is to go on");
  }
  std::istringstream numbers{std::string(take_line(bytes))};
  std::size_t size = 0;
  std::uint64_t hash = 0;
  if (!(numbers >> size >> hash)) throw InputError("damaged");
  if (bytes.size() != size) throw InputError(bytes.size() < size ? "truncated" : "too long");
  if (fnv1a64(bytes) != hash) throw InputError("damaged");
  return bytes;
}

}  // namespace stairwell::nn
