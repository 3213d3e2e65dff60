// A small native log on disk for tests to damage.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "problems/log/native_log.h"
#include "tests/common/test_files.h"

namespace trueline {

inline void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

// The first occurrence of `from` in the file becomes `to`.
inline void ReplaceIn(const std::filesystem::path& path, const std::string& from,
                      const std::string& to) {
  std::string text = ReadText(path);
  text.replace(text.find(from), from.size(), to);
  WriteText(path, text);
}

// A log that was written and read again.
inline FlightLog ReadBack(const FlightLog& log) {
  const TestFolder folder;
  WriteNativeLog(log, folder.directory());
  return ReadNativeLog(folder.directory());
}

class LogFiles : public TestFolder {
 public:
  LogFiles() {
    WriteText(*this / "log.yaml", "name: test\nframe: NED\nbody: FRD\ngravity: 9.81\n");
    WriteText(*this / "imu.csv",
              "t [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]\n"
              "1.00,0.1,0.2,-9.81,0.01,0.02,0.03\n"
              "1.01,0.2,0.3,-9.82,0.02,0.03,0.04\n"
              "1.02,0.3,0.4,-9.83,0.03,0.04,0.05\n");
    WriteText(*this / "fixes.csv",
              "t [s],x [m],y [m],z [m],sigma [m],gate [1]\n"
              "1.005,1,2,-1.5,0.1,0\n"
              "1.015,1.1,2,-1.5,0.1,0\n");
  }

  FlightLog Read() const { return ReadNativeLog(directory()); }
  std::string Error() const {
    return ErrorOf([this] { Read(); });
  }
};

}  // namespace trueline
