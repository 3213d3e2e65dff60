#include "problems/result/render.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/verbs.h"

namespace trueline {
namespace {

// Debian's own Python is tried first: another python3 in PATH often lacks plotly.
const char* Python() {
  return ::access("/usr/bin/python3", X_OK) == 0 ? "/usr/bin/python3" : "python3";
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
  const ProgramRun outcome = RunProgram(command, STDERR_FILENO);
  const std::string reason = LastLine(outcome.text);
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
                                 "leave the page out by --report=false");
}

std::string OneScreen(const std::string& whole, const std::string& brief, bool verbose) {
  constexpr int kScreen = 40;  // lines
  const auto lines = std::ranges::count(whole, '\n');
  if (verbose || lines <= kScreen) return whole;
  return fmt::format("{}all {} lines: --verbose; they stand in the files of the result, too\n",
                     brief, lines);
}

void Publish(const std::string& verb, bool report, bool quiet, const std::string& table,
             ResultFolder* out, const std::vector<std::string>& more) {
  std::string failure;
  if (report) {
    std::vector<std::string> arguments = {"--result=" + out->path().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    failure = RunReport(verb, arguments, out->path() / "report.html");
  }
  out->Commit(quiet);
  if (!quiet) fmt::print("{}", table);
  const std::string page = report && failure.empty() ? "/report.html" : "";
  if (!quiet) fmt::print("results: {}\n", WithFinalNames(out->path().string() + page));
  if (!failure.empty()) throw InputError(failure + "; the other results are complete");
}

}  // namespace trueline
