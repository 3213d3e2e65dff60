// The flights that --log and --against name: native logs, foreign files, folders of either, globs.
#pragma once

#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

struct NamedFlight {
  std::string path;
  int session = -1;  // number of the folder that it lies in; -1 where it is named itself
};

// What a list with commas names. A folder with log.yaml is a flight; another folder stands for the
// logs in it, which are of one session. Throws InputError for what is not there.
std::vector<NamedFlight> FlightsOf(const std::string& list);

// A native log, or a foreign one converted by `map` (empty: by the map that ships for it). Throws
// InputError for what can't be read, NoUsableResult where no map fits.
FlightLog ReadOrConvert(const std::string& path, const std::string& map);

}  // namespace trueline
