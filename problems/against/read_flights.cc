#include <glob.h>

#include <algorithm>
#include <filesystem>

#include "problems/against/comparison.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/log/native_log.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> Matches(const std::string& pattern) {
  glob_t found{};
  std::vector<std::string> paths;
  if (::glob(pattern.c_str(), 0, nullptr, &found) == 0) {
    paths.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  }
  ::globfree(&found);
  return paths;
}

// Texts that lie beside logs.
bool IsNotice(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.starts_with(".") || name.starts_with("LICENSE") || name.starts_with("README") ||
         name.ends_with(".md");
}

// The native logs in a folder or, without one, its files.
std::vector<std::string> LogsIn(const fs::path& folder) {
  std::vector<std::string> logs, files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (IsNativeLog(entry.path())) logs.push_back(entry.path().string());
    if (entry.is_regular_file() && !IsNotice(entry.path())) files.push_back(entry.path().string());
  }
  std::vector<std::string>& there = logs.empty() ? files : logs;
  std::ranges::sort(there);
  return there;
}

}  // namespace

std::vector<NamedFlight> FlightsOf(const std::string& list) {
  std::vector<NamedFlight> flights;
  int sessions = 0;
  for (const std::string& entry : SplitPaths(list)) {
    const std::vector<std::string> paths =
        fs::exists(entry) ? std::vector<std::string>{entry} : Matches(entry);
    if (paths.empty()) throw InputError(entry + ": there is no such log or folder; check the path");
    for (const std::string& path : paths) {
      if (!fs::is_directory(path) || IsNativeLog(path)) {
        flights.push_back({path});
        continue;
      }
      const std::vector<std::string> logs = LogsIn(path);
      if (logs.empty())
        throw InputError(
            path + ": the folder holds no log; name a flight: a folder with log.yaml, or its file");
      for (const std::string& log : logs) flights.push_back({log, sessions});
      ++sessions;
    }
  }
  return flights;
}

std::vector<NamedFlight> ReferencesOf(const NamedFlight& flight, const std::string& list) {
  std::vector<NamedFlight> references = FlightsOf(list);
  std::erase_if(references, [&](const NamedFlight& reference) {
    return fs::equivalent(reference.path, flight.path);
  });
  if (references.empty()) throw InputError("--against: names no flight but the one in --log");
  return references;
}

}  // namespace trueline
