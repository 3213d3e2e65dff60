// The reader of native logs. The first byte chooses the file that has the other bytes: log.yaml or
// a stream; the other files are those of a good log of a second.
#include "problems/common/error.h"
#include "problems/log/native_log.h"
#include "tests/fuzz/fuzz_file.h"

namespace {

trueline::FlightLog GoodLog() {
  trueline::FlightLog log;
  log.name = "good";
  for (trueline::TimeNs t = 0; t < 1'000'000'000; t += 10'000'000) {
    log.imu.push_back({t, {0.1, 0.0, -9.81}, {0.0, 0.0, 0.1}});
    log.attitude.push_back({t, Eigen::Quaterniond::Identity()});
  }
  log.fixes.push_back({500'000'000, {1.0, 2.0, -1.5}, 0.1, 0});
  return log;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const trueline::FuzzFile folder("unused");
  static const std::vector<std::string> files = trueline::NativeLogFiles();
  if (size == 0) return 0;
  trueline::WriteNativeLog(GoodLog(), folder.folder());
  const std::filesystem::path chosen = folder.folder() / files[data[0] % files.size()];
  std::ofstream(chosen, std::ios::binary)
      .write(reinterpret_cast<const char*>(data + 1), static_cast<std::streamsize>(size - 1));
  try {
    trueline::ReadNativeLog(folder.folder());
  } catch (const trueline::InputError&) {
  }
  std::filesystem::remove(chosen);
  return 0;
}
