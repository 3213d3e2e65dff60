#include "problems/result/render.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>  // environ (a GNU extension, on for C++)

#include "problems/common/app.h"
#include "problems/common/error.h"

namespace trueline {
namespace {

// Debian's own Python is tried first: another python3 in PATH often lacks plotly.
const char* Python() {
  return ::access("/usr/bin/python3", X_OK) == 0 ? "/usr/bin/python3" : "python3";
}

struct Outcome {
  int code = -1;
  std::string said;  // on standard error
};

Outcome Run(std::vector<std::string> command) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return {};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  std::vector<char*> argv;
  argv.reserve(command.size() + 1);
  for (std::string& word : command) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  Outcome outcome;
  char part[4096];
  for (ssize_t size = 0; (size = ::read(ends[0], part, sizeof part)) > 0;) {
    outcome.said.append(part, static_cast<std::size_t>(size));
  }
  ::close(ends[0]);
  int status = 0;
  if (failed != 0 || ::waitpid(child, &status, 0) < 0 || !WIFEXITED(status)) return outcome;
  outcome.code = WEXITSTATUS(status);
  return outcome;
}

// The last line of what the script said: its own error, or that of Python.
std::string LastLine(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace

std::string RunReport(const std::string& verb, const std::vector<std::string>& arguments,
                      const std::filesystem::path& out) {
  std::vector<std::string> command = {Python(), FindShared("report/report.py"), verb};
  command.insert(command.end(), arguments.begin(), arguments.end());
  command.push_back("--out=" + out.string());
  const Outcome outcome = Run(command);
  const std::string reason = LastLine(outcome.said);
  if (outcome.code == 0) {
    if (!reason.empty()) Warn(reason, false);
    return "";
  }
  constexpr int kRefused = 2;  // by the script, which states the reason
  return fmt::format(
      "no {} was written ({}){}", out.filename().string(),
      reason.empty() ? fmt::format("exit code {} of '{}'", outcome.code, fmt::join(command, " "))
                     : reason,
      outcome.code == kRefused ? ""
                               : ". Install python3-plotly, python3-pandas and python3-yaml, or "
                                 "give --report=false");
}

std::string RenderReport(const std::string& verb, const std::vector<std::string>& arguments,
                         const std::filesystem::path& directory) {
  const std::string failure = RunReport(verb, arguments, directory / "report.html");
  return failure.empty() ? "" : failure + "; the other results are complete";
}

void Publish(const std::string& verb, bool report, bool quiet, const std::string& table,
             ResultFolder* out, const std::vector<std::string>& more) {
  std::string failure;
  if (report) {
    std::vector<std::string> arguments = {"--result=" + out->path().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    failure = RenderReport(verb, arguments, out->path());
  }
  out->Commit(quiet);
  if (!quiet) fmt::print("{}", table);
  if (!failure.empty()) throw InputError(failure);
}

}  // namespace trueline
