// The flights that --log and --against name: native logs, foreign files, folders of either, globs.
#pragma once

#include <string>
#include <vector>

namespace trueline {

struct NamedFlight {
  std::string path;
  int session = -1;  // number of the folder that it lies in; -1 where it is named itself
};

// What a list with commas names. A folder with log.yaml is a flight; another folder stands for the
// logs in it, which are of one session. Throws InputError for what is not there.
std::vector<NamedFlight> FlightsOf(const std::string& list);

// The same without the flight itself, as folders may hold it.
std::vector<NamedFlight> ReferencesOf(const NamedFlight& flight, const std::string& list);

}  // namespace trueline
