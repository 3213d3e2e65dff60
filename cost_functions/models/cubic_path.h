// The cubic through position and velocity at both ends of a step (Hermite).
#pragma once

namespace trueline {

// Position at the fraction `u` of the step, which lasts `seconds`; extrapolates outside 0 to 1.
// `P`: a vector, or the scalar T itself.
template <class P, class T>
P CubicPath(const P& p0, const P& v0, const P& p1, const P& v1, double seconds, const T& u) {
  const P chord = p1 - p0, s0 = v0 * seconds, s1 = v1 * seconds;
  return p0 + u * (s0 + u * (3.0 * chord - 2.0 * s0 - s1 + u * (s0 + s1 - 2.0 * chord)));
}

// The velocity there.
template <class P, class T>
P CubicPathVelocity(const P& p0, const P& v0, const P& p1, const P& v1, double seconds,
                    const T& u) {
  const P chord = p1 - p0, s0 = v0 * seconds, s1 = v1 * seconds;
  const P square = 3.0 * chord - 2.0 * s0 - s1, cube = s0 + s1 - 2.0 * chord;
  return (s0 + u * (2.0 * square + 3.0 * u * cube)) / seconds;
}

}  // namespace trueline
