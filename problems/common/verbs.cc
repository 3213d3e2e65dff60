#include "problems/common/verbs.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>  // environ (a GNU extension, on for C++)

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <system_error>

#include "problems/common/app.h"

namespace trueline {
namespace fs = std::filesystem;
namespace {

const std::string kPrefix = "trueline-";

bool IsExecutable(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

// Levenshtein distance: insertions, deletions and replacements.
std::size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

ProgramRun RunProgram(std::vector<std::string> command, int stream) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return {};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], stream);
  if (stream == STDOUT_FILENO) {
    ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  }
  std::vector<char*> argv;
  argv.reserve(command.size() + 1);
  for (std::string& word : command) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  ProgramRun run;
  char part[4096];
  for (ssize_t size = 0; (size = ::read(ends[0], part, sizeof part)) > 0;) {
    run.text.append(part, static_cast<std::size_t>(size));
  }
  ::close(ends[0]);
  int status = 0;
  if (failed != 0 || ::waitpid(child, &status, 0) < 0 || !WIFEXITED(status)) return run;
  run.code = WEXITSTATUS(status);
  return run;
}

std::map<std::string, fs::path> FindVerbs(const std::vector<fs::path>& folders) {
  std::map<std::string, fs::path> verbs;
  for (const fs::path& folder : folders) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      const std::string name = it->path().filename().string();
      if (name.starts_with(kPrefix) && name.size() > kPrefix.size() && IsExecutable(it->path())) {
        verbs.try_emplace(name.substr(kPrefix.size()), it->path());
      }
    }
  }
  return verbs;
}

std::vector<fs::path> VerbFolders() {
  std::vector<fs::path> folders;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(program.parent_path());
  const char* path = std::getenv("PATH");
  for (const std::string& folder : SplitList(path ? path : "", ':')) folders.emplace_back(folder);
  return folders;
}

std::string OneLineHelp(const fs::path& program) {
  const std::string text = RunProgram({program.string(), "--help"}, STDOUT_FILENO).text;
  const std::string name = program.filename().string() + ": ";  // as gflags begins its help
  const std::size_t begin = text.starts_with(name) ? name.size() : 0;
  const std::size_t line_end = text.find('\n', begin);
  const std::string line = text.substr(begin, line_end - begin);
  return line.substr(0, line.find(". "));
}

std::string ClosestVerb(const std::string& word, const std::map<std::string, fs::path>& verbs) {
  std::string closest;
  std::size_t least = 4;
  for (const auto& [verb, program] : verbs) {
    const std::size_t distance = EditDistance(word, verb);
    if (distance < least) {
      least = distance;
      closest = verb;
    }
  }
  return closest;
}

}  // namespace trueline
