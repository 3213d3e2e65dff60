// A small native log on disk that tests then spoil.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "problems/common/error.h"
#include "problems/log/native_log.h"

namespace trueline {

inline void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

inline std::string ReadText(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

// The first occurrence of `from` in the file becomes `to`.
inline void ReplaceIn(const std::filesystem::path& path, const std::string& from,
                      const std::string& to) {
  std::string text = ReadText(path);
  text.replace(text.find(from), from.size(), to);
  WriteText(path, text);
}

inline std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

// A directory of its own for each test, removed afterwards.
class LogFiles {
 public:
  LogFiles() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::path(testing::TempDir()) /
                 (std::string(test->test_suite_name()) + "_" + test->name());
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
    WriteText(directory_ / "log.yaml", "name: test\nframe: NED\nbody: FRD\ngravity: 9.81\n");
    WriteText(directory_ / "imu.csv",
              "t [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]\n"
              "1.00,0.1,0.2,-9.81,0.01,0.02,0.03\n"
              "1.01,0.2,0.3,-9.82,0.02,0.03,0.04\n"
              "1.02,0.3,0.4,-9.83,0.03,0.04,0.05\n");
    WriteText(directory_ / "fixes.csv",
              "t [s],x [m],y [m],z [m],sigma [m],gate [1]\n"
              "1.005,1,2,-1.5,0.1,0\n"
              "1.015,1.1,2,-1.5,0.1,0\n");
  }
  ~LogFiles() { std::filesystem::remove_all(directory_); }
  LogFiles(const LogFiles&) = delete;
  LogFiles& operator=(const LogFiles&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return directory_ / name; }
  const std::filesystem::path& directory() const { return directory_; }
  FlightLog Read() const { return ReadNativeLog(directory_); }
  std::string Error() const {
    return ErrorOf([this] { Read(); });
  }

 private:
  std::filesystem::path directory_;
};

}  // namespace trueline
