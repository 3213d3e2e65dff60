#include "problems/rotor/rotor_variant.h"

#include <utility>

namespace trueline {

RotorColumns VariantColumns(const RotorAeroModel& model, const RotorData& data,
                            std::vector<RotorVariant> variants) {
  const int count = static_cast<int>(variants.size());
  const auto accelerations = [&model, &data, variants = std::move(variants)](
                                 double t, const RotorState& x, Eigen::MatrixXd* out) {
    const RotorInput input = data.InputAt(t);
    const auto base = model.BodyAccelerationOf(x.data(), input);
    for (std::size_t i = 0; i < variants.size(); ++i) {
      const RotorVariant& variant = variants[i];
      RotorState moved = x;
      moved.tail<RotorAeroModel::kConstants>() += variant.added;
      const auto there =
          variant.data != nullptr
              ? variant.model.BodyAccelerationOf(moved.data(), variant.data->InputAt(t))
              : variant.model.BodyAccelerationOf(moved.data(), input);
      out->col(static_cast<Eigen::Index>(i)).head<6>() << there.force - base.force,
          there.turn - base.turn;
    }
  };
  return {count, accelerations};
}

Eigen::MatrixXd ConsideredCovariance(const RotorAeroModel& model, const RotorData& data,
                                     const RotorBatchOptions& options,
                                     const RotorBatchResult& batch,
                                     std::vector<RotorVariant> variants) {
  constexpr int kConstants = RotorAeroModel::kConstants;
  if (variants.empty()) return Eigen::MatrixXd::Zero(kConstants, kConstants);
  const double whole = data.poses.back().t - data.poses.front().t;
  return RotorNormal(model, data, options, batch, VariantColumns(model, data, std::move(variants)),
                     whole)
      .ColumnCovariance();
}

}  // namespace trueline
