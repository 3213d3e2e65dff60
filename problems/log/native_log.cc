#include "problems/log/native_log.h"

#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/sha256.h"
#include "problems/log/imu_health.h"
#include "problems/log/log_yaml.h"
#include "problems/log/streams.h"

namespace trueline {

namespace fs = std::filesystem;

FlightLog ReadNativeLog(const fs::path& directory) {
  FlightLog log = ReadCommandLog(directory);
  if (!log.imu.empty()) return log;
  throw ErrorAt((directory / "imu.csv").string(), 0,
                "is missing; every log needs it, but for trueline-diagnose --against");
}

FlightLog ReadCommandLog(const fs::path& directory) {
  if (!fs::is_directory(directory)) {
    throw ErrorAt(directory.string(), 0,
                  "is no directory; a native log is a directory with log.yaml and imu.csv");
  }
  FlightLog log;
  log.directory = directory.string();
  const fs::path whole = fs::absolute(directory).lexically_normal();
  const fs::path yaml = directory / "log.yaml";
  ReadLogYaml(yaml, &log);
  if (log.name.empty()) log.name = whole.filename().string();
  log.sha256["log.yaml"] = Sha256OfFile(yaml);
  ReadStreams(directory, &log);
  log.imu.shrink_to_fit();  // by far the longest streams
  log.attitude.shrink_to_fit();
  if (log.imu.empty()) return log;
  for (const std::string& warning : ImuWarnings(log.imu)) log.warnings.push_back(warning);
  return log;
}

std::vector<std::string> NativeLogFiles() {
  std::vector<std::string> files = {"log.yaml"};
  const FlightLog log;
  ForEachStream(log, [&](const Stream& stream, const auto&) {
    files.push_back(std::string(stream.name) + ".csv");
  });
  return files;
}

void WriteNativeLog(const FlightLog& log, const fs::path& directory) {
  WriteStreams(log, directory);
  WriteFileAtomically(directory / "log.yaml", LogYaml(log));
}

}  // namespace trueline
