#include "problems/prediction/wrench_flight.h"

#include "problems/common/error.h"
#include "problems/prediction/gzip_columns.h"

namespace trueline {
namespace {

const std::vector<std::string> kMeasured = {
    "t",     "vel x", "vel y", "vel z",     "ang vel x", "ang vel y", "ang vel z",
    "acc x", "acc y", "acc z", "ang acc x", "ang acc y", "ang acc z", "mot 1",
    "mot 2", "mot 3", "mot 4", "dmot 1",    "dmot 2",    "dmot 3",    "dmot 4"};
const std::vector<std::string> kPublished = {"bemnn_fx", "bemnn_fy", "bemnn_fz",
                                             "bemnn_tx", "bemnn_ty", "bemnn_tz"};

WrenchRow RowOf(const Eigen::VectorXd& values) {
  WrenchRow row;
  row.t = values[0];
  row.v = values.segment<3>(1);
  row.w = values.segment<3>(4);
  row.specific_force = values.segment<3>(7);
  row.dw = values.segment<3>(10);
  for (int i = 0; i < 4; ++i) row.rotors[i] = {values[13 + i], values[17 + i]};
  return row;
}

}  // namespace

WrenchFlight ReadWrenchFlight(const std::filesystem::path& folder, const std::string& name) {
  std::filesystem::path file = folder / (name + ".csv.gz");
  if (!std::filesystem::exists(file)) file = folder / (name + ".csv");
  if (!std::filesystem::exists(file)) {
    throw InputError((folder / name).string() +
                     ".csv.gz: is missing; --data must hold the flights");
  }
  WrenchFlight flight;
  flight.name = name;
  const Eigen::MatrixXd values = ReadColumns(file, kMeasured);
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    flight.rows.push_back(RowOf(values.row(i).transpose()));
  }
  if (HasColumn(file, kPublished.front())) {
    flight.published = ReadColumns(file, kPublished).transpose();
  }
  return flight;
}

}  // namespace trueline
