// Conversion of rows of foreign files to samples of native streams.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/import/import_map.h"
#include "problems/import/stamp_reader.h"

namespace trueline {

// Receives the rows of its file one after another, and appends samples to one stream of a log.
class StreamImport {
 public:
  virtual ~StreamImport() = default;
  virtual void AddRow(const ForeignRow& row) = 0;
  // The parts that the clock's steps back divide the kept rows into, where rows may be sorted.
  virtual std::vector<ClockPart> Parts() const = 0;
  // Leaves out all rows but those of a part of the file. Returns how many; before Finish().
  virtual std::size_t Keep(const ClockPart& part) = 0;
  virtual std::size_t rows() const = 0;  // that became samples; before Finish()
  // s, of the time with such rows, without long gaps; before Finish().
  virtual double Covered() const = 0;
  virtual const char* name() const = 0;
  virtual void Finish(std::vector<std::string>* warnings) = 0;  // after the last row
  virtual const StreamMap& map() const = 0;
};

// Finds the columns that a stream names. Throws InputError for one that is not there.
void BindColumns(const ForeignRow& row, StreamMap* stream);

// One for each stream of the map. `log` must outlive the result. `fix_sigma` (m), if given,
// replaces the map's.
std::vector<std::unique_ptr<StreamImport>> MakeImports(const ImportMap& map,
                                                       const std::vector<std::string>& files,
                                                       const std::optional<double>& fix_sigma,
                                                       FlightLog* log);

}  // namespace trueline
