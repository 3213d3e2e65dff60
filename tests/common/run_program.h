// Programs as a user runs them: exit code and both outputs.
#pragma once

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

#include "tests/common/test_files.h"

namespace trueline {

struct Outcome {
  int exit_code;
  std::string out, err;
};

inline void PrintTo(const Outcome& outcome, std::ostream* out) {
  *out << "exit code " << outcome.exit_code << "\n" << outcome.out << outcome.err;
}

inline Outcome RunShell(const std::string& command) {
  const std::string file = fmt::format("{}/run_{}", testing::TempDir(), getpid());
  const int status =
      std::system(fmt::format("{{ {}\n}} >'{}.out' 2>'{}.err'", command, file, file).c_str());
  Outcome outcome{WEXITSTATUS(status), ReadText(file + ".out"), ReadText(file + ".err")};
  for (const char* ending : {".out", ".err"}) std::filesystem::remove(file + ending);
  return outcome;
}

inline std::filesystem::path App(const std::string& verb) {
  return std::filesystem::path(TRUELINE_TEST_APPS_DIR) / ("trueline-" + verb);
}

inline Outcome RunApp(const std::string& verb, const std::string& arguments) {
  return RunShell(fmt::format("'{}' {}", App(verb).string(), arguments));
}

// Ends with this exit code, and says such a thing about it.
inline auto Ends(int exit_code, const testing::Matcher<std::string>& err) {
  return AllOf(testing::Field("exit_code", &Outcome::exit_code, exit_code),
               testing::Field("err", &Outcome::err, err));
}
inline auto Refuses(const std::string& why) { return Ends(2, HasSubstr(why)); }

}  // namespace trueline
