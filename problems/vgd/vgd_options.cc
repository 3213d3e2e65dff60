#include "problems/vgd/vgd_options.h"

#include "problems/common/units.h"
#include "problems/common/yaml_archive.h"

namespace trueline {
namespace {

void SerializePriors(YamlArchive* a, VgdOptions* o) {
  for (int i = 0; i < kMotionSize; ++i) {
    ParameterPrior* prior = &o->priors[i];
    const char* name = kTheta[i].name;
    const double unit = FileUnit(i);
    a->Map(name, [&](YamlArchive* entry) {
      entry->Value("mean", &prior->mean, unit);
      entry->Value("sigma", &prior->sigma, unit);
      entry->Value("lower", &prior->lower, unit);
      entry->Value("upper", &prior->upper, unit);
      entry->OnOneLine();
    });
    a->Require(prior->sigma > 0.0, name, "sigma must be above zero");
    a->Require(prior->lower < prior->mean && prior->mean < prior->upper, name,
               "needs lower < mean < upper");
  }
}

void SerializeProcess(YamlArchive* a, ProcessNoise* process) {
  a->NotNegative("acceleration_mps2_per_sqrt_hz", &process->acceleration);
  a->Positive("thrust_factor", &process->thrust_factor);
  a->NotNegative("tilt_deg", &process->tilt, kDegree);
  a->NotNegative("heading_deg", &process->heading, kDegree);
  a->Positive("memory_s", &process->memory);
  a->NotNegative("gust_mps2", &process->gust);
  a->Positive("gust_memory_s", &process->gust_memory);
}

void SerializeDragMeasurement(YamlArchive* a, DragMeasurementOptions* options) {
  a->Value("enabled", &options->enabled);
  a->Positive("interval_s", &options->interval);
  a->Positive("sigma_mps2", &options->sigma);
  a->Positive("bias_sigma_mps2", &options->bias_sigma);
}

void SerializeDrive(YamlArchive* a, DriveOptions* drive) {
  a->Choice("thrust", &drive->thrust, kThrustSources);
  a->Choice("attitude", &drive->attitude,
            {{"complementary_filter", AttitudeSource::kComplementaryFilter},
             {"logged", AttitudeSource::kLogged}});
  a->NotNegative("filter_k_p_per_s", &drive->filter.k_p);
  a->NotNegative("filter_k_i_per_s2", &drive->filter.k_i);
  a->Value("attitude_latency_s", &drive->attitude_latency);
  a->NotNegative("longest_hold_s", &drive->longest_hold);
  a->Map("errors", [errors = &drive->attitude_errors](YamlArchive* map) {
    map->NotNegative("gyro_bias_sigma_radps", &errors->gyro_bias);
    map->NotNegative("gain_sigma_per_s", &errors->gain);
    map->NotNegative("share_sigma", &errors->share);
  });
  a->Positive("max_gap_s", &drive->max_gap);
}

}  // namespace

void Serialize(YamlArchive* a, VgdOptions* o) {
  a->Count("gamma", &o->gamma);
  a->Count("min_window_fixes", &o->min_window_fixes);
  a->Map("priors", [o](YamlArchive* map) { SerializePriors(map, o); });
  a->Choice(
      "ranges", &o->ranges,
      {{"bounds", RangeUse::kBounds}, {"prior", RangeUse::kPrior}, {"start", RangeUse::kStart}});
  a->Choice("start", &o->start,
            {{"mean", SearchStart::kMean},
             {"previous", SearchStart::kPrevious},
             {"random", SearchStart::kRandom}});
  a->Count("start_seed", &o->start_seed);
  a->Choice("loss", &o->loss,
            {{"cauchy", FixLoss::kCauchy},
             {"huber", FixLoss::kHuber},
             {"none", FixLoss::kNone},
             {"norm", FixLoss::kNorm}});
  a->Positive("loss_scale_sigmas", &o->loss_scale);
  a->Value("whiten", &o->whiten);
  a->Map("process", [o](YamlArchive* map) { SerializeProcess(map, &o->process); });
  a->Value("adapt_drift", &o->adapt_drift);
  a->Positive("knot_interval_s", &o->knot_interval);
  a->Map("drag_measurement",
         [o](YamlArchive* map) { SerializeDragMeasurement(map, &o->drag_measurement); });
  a->Choice("solver", &o->solver,
            {{"bfgs", VgdSolver::kBfgs},
             {"gradient_descent", VgdSolver::kGradientDescent},
             {"trust_region", VgdSolver::kTrustRegion}});
  a->Require(o->ranges != RangeUse::kBounds || o->solver == VgdSolver::kTrustRegion, "solver",
             "must be trust_region where ranges are bounds: line searches have none");
  a->Count("max_iterations", &o->max_iterations);
  a->Positive("tolerance", &o->tolerance);
  a->Positive("max_block_s", &o->max_block);
  a->Positive("pass_gap_s", &o->passes.pass_gap);
  a->Positive("max_arc_s", &o->passes.max_arc);
  a->Count("min_fixes", &o->passes.min_fixes);
  a->Nested("continuous_fixes", &o->passes.continuous);
  a->Map("drive", [o](YamlArchive* map) { SerializeDrive(map, &o->drive); });
}

void Serialize(YamlArchive* a, KinematicOptions* o) {
  a->Value("initial_attitude", &o->initial_attitude);
  a->Positive("accel_bias_sigma_mps2", &o->accel_bias_sigma);
  a->Positive("gyro_bias_sigma_deg_per_s", &o->gyro_bias_sigma, kDegree);
  a->Positive("tilt_sigma_deg", &o->tilt_sigma, kDegree);
  a->Positive("heading_sigma_deg", &o->heading_sigma, kDegree);
}

}  // namespace trueline
