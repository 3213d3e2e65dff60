// trueline VERB ...: runs trueline-VERB ..., found beside this program or in PATH.
#include <unistd.h>

#include <cstdio>
#include <string>

#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/verbs.h"

namespace {

using Verbs = std::map<std::string, std::filesystem::path>;

int PrintHelp(const Verbs& verbs) {
  fmt::print(
      "Trueline {}: from a drone's flight log to a calibrated model.\n\n"
      "  trueline VERB --help          what a verb does, with examples\n"
      "  trueline VERB [FLAGS]         the same as trueline-VERB [FLAGS]\n\nVerbs:\n",
      trueline::Version());
  for (const auto& [verb, program] : verbs) {
    fmt::print("  {:<12} {}\n", verb, trueline::OneLineHelp(program));
  }
  fmt::print(
      "\nHandbook: config/handbook/README.md of a clone, "
      "/usr/share/trueline/handbook/index.html of the package\n"
      "Configurations: config of a clone, /usr/share/trueline/config of the package\n");
  return trueline::kExitDone;
}

trueline::InputError UnknownVerb(const std::string& word, const Verbs& verbs) {
  const std::string closest = trueline::ClosestVerb(word, verbs);
  return trueline::InputError(fmt::format(
      "'{}' is no verb{}; `trueline --help` lists them", word,
      closest.empty() ? std::string() : fmt::format(" (did you mean `trueline {}`?)", closest)));
}

int Run(int argc, char** argv) {
  const Verbs verbs = trueline::FindVerbs(trueline::VerbFolders());
  const std::string word = argc > 1 ? argv[1] : "";
  if (word == "--help" || word == "-help" || word == "-h" || word == "help") {
    return PrintHelp(verbs);
  }
  if (word == "--version" || word == "-version") {
    fmt::print("trueline {}\n", trueline::Version());
    return trueline::kExitDone;
  }
  if (word.empty()) throw trueline::InputError("which verb? `trueline --help` lists them");
  const auto found = verbs.find(word);
  if (found == verbs.end()) throw UnknownVerb(word, verbs);

  std::string program = found->second.string();
  argv[1] = program.data();  // gflags names the program by its first argument
  execv(program.c_str(), argv + 1);
  throw trueline::InputError(fmt::format("'{}' can't be run", program));
}

}  // namespace

int main(int argc, char** argv) {
  return trueline::RunGuarded("trueline", [&] { return Run(argc, argv); });
}
