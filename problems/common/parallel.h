#pragma once

#include <functional>

namespace trueline {

// A number of threads as flags state it: all cores for 0 or less.
int CoresFor(int threads);

// The number of threads that ParallelRuns would use here, if its caller states none.
int FreeCores();

// Calls body(0) ... body(count - 1) on `threads` threads (0: all cores). Results must be stored by
// index, so that they do not depend on the number of threads. The first exception is rethrown. With
// `threads` of 1 the bodies keep to one core in what they call, too.
void ParallelFor(int count, int threads, const std::function<void(int)>& body);

// The same for bodies of microseconds: `run` in a row on one thread, on at most `threads` threads
// (0: all cores). The calling thread alone does the work if there is only one run, or if it is
// itself one of ParallelFor's.
void ParallelRuns(int count, int run, const std::function<void(int)>& body, int threads = 0);

}  // namespace trueline
