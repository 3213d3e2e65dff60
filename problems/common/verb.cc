#include "problems/common/verb.h"

#include <fmt/format.h>
#include <gflags/gflags.h>

#include <algorithm>

#include "problems/common/app.h"
#include "problems/common/error.h"

namespace trueline {

std::string TextOf(const FlagValue& value) {
  return std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
}

bool Verb::Enter(std::string name, std::string usage, std::function<int()> run) {
  name_ = std::move(name);
  usage_ = std::move(usage);
  run_ = std::move(run);
  AllVerbs().push_back(this);
  return true;
}

Flag& Verb::Find(const std::string& name) {
  const auto found =
      std::ranges::find_if(flags_, [&](const Flag& flag) { return flag.name == name; });
  if (found != flags_.end()) return *found;
  throw InputError(fmt::format("{} has no flag '{}'", name_, name));
}

int Verb::Main(int argc, char** argv) {
  const std::string program = "trueline-" + name_;
  static const std::string file = "apps/" + name_ + ".cc";  // --help lists the flags of apps/ only
  for (Flag& flag : flags_) {
    std::visit(
        [&]<class T>(T& value) {
          gflags::FlagRegisterer(flag.name.c_str(), flag.help.c_str(), file.c_str(), &value,
                                 &std::get<T>(flag.initial));
        },
        flag.value);
  }
  return RunApp(program, usage_, &argc, &argv, run_);
}

std::vector<Verb*>& AllVerbs() {
  static std::vector<Verb*> verbs;
  return verbs;
}

std::function<void(const std::string&)>& WarningSink() {
  static std::function<void(const std::string&)> sink;
  return sink;
}

}  // namespace trueline
