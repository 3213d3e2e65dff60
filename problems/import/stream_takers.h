// The streams of a column map, ready to take rows into a log.
#pragma once

#include <memory>

#include "problems/import/stream_import.h"

namespace trueline {

struct StreamTaker {
  std::size_t input;  // index of the file that it reads
  std::unique_ptr<RowTaker> taker;
};

// `log` must outlive the result. `fix_sigma` (m) takes the place of the map's, where given.
std::vector<StreamTaker> MakeTakers(const ImportMap& map, const std::vector<std::string>& files,
                                    const std::optional<double>& fix_sigma, FlightLog* log);

}  // namespace trueline
