// The verbs of the `trueline` command: programs named trueline-VERB beside it or in PATH.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace trueline {

// What a program wrote, and its exit code; -1 where it could not be started or was killed.
struct ProgramRun {
  int code = -1;
  std::string text;
};
// Runs `command`, found in PATH, and collects its standard output or standard error (`stream`:
// STDOUT_FILENO, which drops the other, or STDERR_FILENO).
ProgramRun RunProgram(std::vector<std::string> command, int stream);

// Verb -> program. Where two folders hold the same verb the earlier folder wins, as in PATH.
// Folders that do not exist hold none.
std::map<std::string, std::filesystem::path> FindVerbs(
    const std::vector<std::filesystem::path>& folders);

// The folder of the running program, then those of the environment variable PATH.
std::vector<std::filesystem::path> VerbFolders();

// The first sentence of a program's gflags usage message, shown by `--help`. Empty if there is
// none.
std::string OneLineHelp(const std::filesystem::path& program);

// The verb that is closest to a misspelt one; empty when none is within three edits.
std::string ClosestVerb(const std::string& word,
                        const std::map<std::string, std::filesystem::path>& verbs);

}  // namespace trueline
