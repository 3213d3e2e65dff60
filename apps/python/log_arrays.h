// Streams of a log as arrays: a row for each sample, first its time (s), then the numbers in the
// order of the native log's columns.
#pragma once

#include <pybind11/numpy.h>

#include <map>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

struct StreamArray {
  std::vector<std::string> columns;  // "t", "ax", ...
  pybind11::array_t<double> rows;    // samples x columns
};

// Of all streams that a log may have.
std::vector<std::string> StreamNames();

// The streams that have samples, by name.
std::map<std::string, StreamArray> ArraysOf(const FlightLog& log);

// Throws InputError for a stream that no log has, or for one with other columns than it has.
void SetStreams(const std::map<std::string, pybind11::array_t<double>>& arrays, FlightLog* log);

}  // namespace trueline
