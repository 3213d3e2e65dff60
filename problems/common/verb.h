// A verb of the program: its text, its flags, and what it runs. The command line starts one verb a
// program (apps/main), the Python module calls all of them in one process (apps/python).
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace trueline {

using FlagValue = std::variant<std::string, bool, std::int32_t, std::uint64_t, double>;

std::string TextOf(const FlagValue& value);

struct Flag {
  std::string name, help;
  FlagValue initial;
  FlagValue value = initial;
};

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
