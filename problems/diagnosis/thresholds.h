// Thresholds that decide in more than one place of a diagnosis: one number for each idea.
#pragma once

#include <cstddef>

namespace trueline {

// Sigmas of a difference: below the first it is chance, beyond the second the two are apart.
inline constexpr double kChanceSigmas = 2.0, kApartSigmas = 3.0;
inline constexpr double kOutlierSigmas = 4.0;  // of a sample: hardly noise
// Of one test, whose hypothesis comes from elsewhere; that a detectable size is not found.
inline constexpr double kSingleAlpha = 0.05;
inline constexpr double kAsGood = 6.0;  // models whose merits differ by less fit equally well
// Of an estimate's size, or of its columns' share: less is another effect's.
inline constexpr double kMostOf = 0.5;
inline constexpr double kSmallPart = 0.1;       // of a step, a sigma or a merit: hardly matters
inline constexpr double kNegligible = 0.01;     // of a step, a precision, an information: none
inline constexpr double kNoInformation = 1e-9;  // of all that a column has: less is rounding
inline constexpr double kTails = 4.0;     // degrees of freedom of an error that is known roughly
inline constexpr int kFewestBlocks = 10;  // whose scatter gives a sigma, and that two halves need
// Clusters of a flight belong to one half or the other in blocks of three, which share fixes.
inline constexpr int kBlockClusters = 3;
inline constexpr double kSamePlace = 0.5;  // m, between places that count as one
inline constexpr double kMovedBy = 0.3;    // s, by which effects move stamps at most
// The best candidates, pairs and terms: their noise is learned again; they are tried by fits.
inline constexpr std::size_t kRelearned = 6, kTriedByFit = 2;
inline constexpr double kNearStrength = 0.4;  // of its logarithm, where noise is learned again
inline constexpr int kRepeats = 3;  // halvings of a step that gains none; times of reweighting
inline constexpr int kMostIterations = 8;  // of a search by linear steps

}  // namespace trueline
