#include "apps/child_process.hpp"

#include "core/errors.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

namespace stairwell::apps {

namespace {

constexpr int kCannotStart = 126;

/// After fork: only calls that are safe there.
[[noreturn]] void become(const char* program, char* const* arguments, const char* output, const char* errors) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody shall write to its files when the parent is gone
  constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC;
  const int in = ::open("/dev/null", O_RDONLY);
  const int out = ::open(output, kFlags, 0644);
  const int err = ::open(errors, kFlags, 0644);
  if (in < 0 || out < 0 || err < 0) ::_exit(kCannotStart);
  ::dup2(in, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(err, STDERR_FILENO);
  ::execv(program, arguments);
  ::_exit(kCannotStart);
}

}  // namespace

ChildProcess::ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& words,
                           const std::filesystem::path& output, const std::filesystem::path& errors) {
  std::vector<std::string> own{program.string()};
  own.insert(own.end(), words.begin(), words.end());
  std::vector<char*> arguments;
  for (std::string& word : own) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  process_ = ::fork();
  if (process_ == 0) become(program.c_str(), arguments.data(), output.c_str(), errors.c_str());
  if (process_ < 0) throw RunError(program.string() + ": cannot be started: " + std::strerror(errno));
}

std::optional<int> ChildProcess::exit_code() {
  if (code_) return code_;
  int status = 0;
  const pid_t ended = ::waitpid(process_, &status, WNOHANG);
  if (ended == 0 || (ended < 0 && errno == EINTR)) return std::nullopt;
  if (ended < 0) {
    code_ = 127;
  } else if (WIFEXITED(status)) {
    code_ = WEXITSTATUS(status);
  } else if (WIFSIGNALED(status)) {
    code_ = 128 + WTERMSIG(status);
  }
  return code_;
}

void ChildProcess::interrupt() const {
  if (!code_) ::kill(process_, SIGINT);
}

}  // namespace stairwell::apps
