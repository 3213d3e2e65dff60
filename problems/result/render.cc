#include "problems/result/render.h"

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

int Run(std::vector<std::string> command) {
  std::vector<char*> argv;
  argv.reserve(command.size() + 1);
  for (std::string& word : command) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  if (::posix_spawnp(&child, argv[0], nullptr, nullptr, argv.data(), environ) != 0) return -1;
  int status = 0;
  if (::waitpid(child, &status, 0) < 0 || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

}  // namespace

std::string RenderReport(const std::string& verb, const std::vector<std::string>& arguments,
                         const std::filesystem::path& directory) {
  std::vector<std::string> command = {Python(), FindShared("report/report.py"), verb};
  command.insert(command.end(), arguments.begin(), arguments.end());
  command.push_back("--out=" + (directory / "report.html").string());
  const int code = Run(command);
  if (code == 0) return "";
  return fmt::format(
      "no report.html was written (exit code {} of '{}'); the other results are complete. Install "
      "python3-plotly, python3-pandas and python3-yaml, or give --report=false",
      code, fmt::join(command, " "));
}

void RequireReport(const std::string& failure) {
  if (!failure.empty()) throw InputError(failure);
}

}  // namespace trueline
