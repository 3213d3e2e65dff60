// Thresholds that decide in more than one place of a diagnosis: one number for each idea.
#pragma once

#include <cstddef>

namespace trueline {

// Sigmas of a difference: below the first it is chance, beyond the second the two are apart.
inline constexpr double kChanceSigmas = 2.0, kApartSigmas = 3.0;
inline constexpr double kOutlierSigmas = 4.0;  // of a sample: hardly noise
inline constexpr double kSingleAlpha = 0.05;   // of one test, whose hypothesis comes from elsewhere
inline constexpr double kPower = 0.95;         // with which a detectable size is found
inline constexpr double kAsGood = 6.0;  // models whose merits differ by less fit equally well
// Of an estimate's size, or of its columns' share: less is another effect's.
inline constexpr double kMostOf = 0.5;
inline constexpr double kNoInformation = 1e-9;  // of all that a column has: less is rounding
inline constexpr double kTails = 4.0;      // degrees of freedom of an error that is known roughly
inline constexpr int kFewestBlocks = 10;   // whose scatter gives a sigma, and that two halves need
inline constexpr double kSamePlace = 0.5;  // m, between places that count as one
inline constexpr double kMovedBy = 0.3;    // s, by which effects move stamps at most
// The best candidates, pairs and terms: their noise is learned again; they are tried by fits.
inline constexpr std::size_t kRelearned = 6, kTriedByFit = 2;
// Of the logarithm of a strength, where noise is learned again; halvings of a step that gains none.
inline constexpr double kNearStrength = 0.4;
inline constexpr int kHalvings = 3;
inline constexpr int kMostIterations = 8;  // of a search by linear steps

}  // namespace trueline
