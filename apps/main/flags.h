// The flags of a verb, and its entry: each apps/VERB.cc includes this header. gflags can't define
// them, as it knows a name once in a process, and the Python module holds all verbs. Its macros,
// which glog brings along, are replaced by others of the same names.
//
//   DEFINE_string(log, "", "the flight");     // FLAGS_log, as with gflags
//   int Run() { ... }
//   TRUELINE_VERB("calibrate", kUsage, Run);  // the last line
#pragma once

#include <gflags/gflags.h>

#include "problems/common/app.h"

namespace {
trueline::Verb this_verb;  // of the file that includes this header
}  // namespace

#undef DEFINE_string
#undef DEFINE_bool
#undef DEFINE_int32
#undef DEFINE_uint64
#undef DEFINE_double
#define TRUELINE_FLAG(type, name, initial, help) \
  static type& FLAGS_##name = this_verb.Add<type>(#name, initial, help)
#define DEFINE_string(name, initial, help) TRUELINE_FLAG(std::string, name, initial, help)
#define DEFINE_bool(name, initial, help) TRUELINE_FLAG(bool, name, initial, help)
#define DEFINE_int32(name, initial, help) TRUELINE_FLAG(std::int32_t, name, initial, help)
#define DEFINE_uint64(name, initial, help) TRUELINE_FLAG(std::uint64_t, name, initial, help)
#define DEFINE_double(name, initial, help) TRUELINE_FLAG(double, name, initial, help)
#define TRUELINE_VERB(name, usage, run) \
  static const bool entered = this_verb.Enter(name, usage, run)
