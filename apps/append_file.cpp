#include "apps/append_file.hpp"

#include "core/errors.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace stairwell::apps {

namespace {
constexpr std::size_t kBuffer_bytes = 1 << 16;
}

AppendFile::AppendFile(std::filesystem::path file, std::uint64_t keep_bytes)
    : file_(std::move(file)), part_(file_.string() + ".part"), written_(keep_bytes) {
  std::error_code ignored;
  if (keep_bytes > 0 && !std::filesystem::exists(part_, ignored)) std::filesystem::rename(file_, part_, ignored);
  if (keep_bytes == 0) std::filesystem::remove(file_, ignored);
  descriptor_ = ::open(part_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor_ < 0) fail(errno);
  const off_t length = ::lseek(descriptor_, 0, SEEK_END);
  if (length < 0 || static_cast<std::uint64_t>(length) < keep_bytes) {
    ::close(descriptor_);
    throw InputError(file_.string() + ": is shorter than its checkpoint says: the run folder is damaged");
  }
  const auto keep = static_cast<off_t>(keep_bytes);
  if (::ftruncate(descriptor_, keep) != 0 || ::lseek(descriptor_, keep, SEEK_SET) != keep) {
    const int error = errno;
    ::close(descriptor_);
    fail(error);
  }
}

AppendFile::~AppendFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void AppendFile::fail(int error) const {
  throw RunError(file_.string() + ": cannot be written: " + std::strerror(error));
}

void AppendFile::append(std::string_view text) {
  buffer_ += text;
  if (buffer_.size() >= kBuffer_bytes) flush();
}

std::uint64_t AppendFile::flush() {
  std::string_view rest = buffer_;
  while (!rest.empty()) {
    const ssize_t count = ::write(descriptor_, rest.data(), rest.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(errno);
    rest.remove_prefix(static_cast<std::size_t>(count));
    written_ += static_cast<std::uint64_t>(count);
  }
  buffer_.clear();
  return written_;
}

void AppendFile::publish() {
  flush();
  if (::fsync(descriptor_) != 0) fail(errno);
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  if (closed != 0 || ::rename(part_.c_str(), file_.c_str()) != 0) fail(errno);
}

}  // namespace stairwell::apps
