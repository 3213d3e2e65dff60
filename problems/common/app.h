// Shared by all executables: verbs, flags, exit codes, messages. Exit codes: 0 done, 2 bad input or
// usage, 3 ran but no usable result, 4 an outcome that --fail_on refuses, 1 a defect of the
// program.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace trueline {

inline constexpr int kExitDone = 0;
inline constexpr int kExitDefect = 1;
inline constexpr int kExitBadInput = 2;
inline constexpr int kExitNoResult = 3;
inline constexpr int kExitRefused = 4;

// The program's version, as stated in every result.
std::string Version();

// What a user reads where a verb fails, on the command line and from Python.
struct Failure {
  int code;          // the program's exit code
  std::string text;  // names place and remedy; control characters are replaced
};

// Of the exception that is being handled.
Failure CurrentFailure();

// A message quotes what a log holds; its control characters would reach the terminal.
std::string Printable(std::string text);

// Runs `body` and turns InputError into one message on standard error and exit code 2, any other
// exception into exit code 1.
int RunGuarded(const std::string& program, const std::function<int()>& body);

// The body of every main: parses gflags (a usage text with examples), answers --help, and runs
// `body` guarded. A word that is no flag is a log (--log or --in), or refused.
int RunApp(const std::string& program, const std::string& usage, int* argc, char*** argv,
           const std::function<int()>& body);

// The flag --fail_on, by which a fleet or a CI refuses a log although its results are written.
class FailOn {
 public:
  // `asked`: the flag; empty: nothing is refused. `outcomes`: from the best to the worst. Throws
  // InputError if `asked` is none of them.
  FailOn(std::string asked, std::vector<std::string> outcomes);
  // kExitRefused if `outcome` is what was asked for, or worse; else `otherwise`.
  int ExitFor(const std::string& outcome, int otherwise = kExitDone) const;

 private:
  std::string asked_;
  std::vector<std::string> outcomes_;
};

// A warning on standard error, unless quiet.
void Warn(const std::string& message, bool quiet);
void WarnAll(const std::vector<std::string>& messages, bool quiet);

// Splits "a,b,c"; empty parts are left out.
std::vector<std::string> SplitList(const std::string& text, char separator = ',');
// Paths with commas between; a text that is the path of one file, or folder, is that alone.
std::vector<std::string> SplitPaths(const std::string& text);

// Path of a file that ships with the program (config/..., report/...): beside the installed
// program, else in the source tree. Throws InputError if it is in neither.
std::string FindShared(const std::string& relative_path);

using FlagValue = std::variant<std::string, bool, std::int32_t, std::uint64_t, double>;

std::string TextOf(const FlagValue& value);

struct Flag {
  std::string name, help;
  FlagValue initial;
  FlagValue value = initial;
};

// A verb of the program: its text, its flags, and what it runs. The command line starts one verb a
// program (apps/main), the Python module calls all of them in one process (apps/python).
class Verb {
 public:
  // The new flag's value; the reference stays valid.
  template <class T>
  T& Add(const char* name, T initial, const char* help) {
    flags_.push_back({name, help, std::move(initial)});
    return std::get<T>(flags_.back().value);
  }
  // Gives the verb its name and what it does, and enters it into AllVerbs().
  bool Enter(std::string name, std::string usage, std::function<int()> run);

  const std::string& name() const { return name_; }
  const std::string& usage() const { return usage_; }
  const std::deque<Flag>& flags() const { return flags_; }
  // Throws InputError for a name that no flag has.
  Flag& Find(const std::string& name);

  // Runs with the flags as they are. Returns the exit code; errors are thrown.
  int Run() const { return run_(); }
  // The body of a main: flags from the command line, errors to standard error.
  int Main(int argc, char** argv);

 private:
  std::string name_, usage_;
  std::deque<Flag> flags_;
  std::function<int()> run_;
};

// The verbs in this process.
std::vector<Verb*>& AllVerbs();

// Takes the warnings of this process; where it is empty they go to standard error, unless quiet.
std::function<void(const std::string&)>& WarningSink();

}  // namespace trueline
