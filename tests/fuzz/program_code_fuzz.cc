// Program code that an audit reads: by its name C++, or Python.
#include <cstdint>
#include <string>

#include "problems/common/error.h"
#include "problems/simulators/parameter_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const char* name : {"vehicle.hpp", "vehicle.py"}) {
    try {
      trueline::ParameterFile::Parse(name, text);
    } catch (const trueline::InputError&) {
    }
  }
  return 0;
}
