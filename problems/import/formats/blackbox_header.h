// The header of a Betaflight blackbox session: settings, and how frames are encoded.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/bytes.h"
#include "problems/import/formats/recording.h"

namespace trueline {

inline constexpr std::string_view kBlackboxStart =
    "H Product:Blackbox flight data recorder by Nicholas Sherlock\n";

struct BlackboxField {
  std::string name;
  bool is_signed = false;
  int predictor = 0;
  int encoding = 0;
};

struct BlackboxHeader {
  std::map<std::string, std::string, std::less<>> settings;
  std::map<char, std::vector<BlackboxField>> frames;  // by letter; P has I's names

  // Adds one line without "H " and its end. False if it makes no sense.
  bool AddLine(std::string_view line);
  // Whether every field of a frame has its encoding and I and P frames are there; call it last.
  bool Finish();

  // Settings that predictors use, set by Finish().
  int min_throttle = 1150, vbat_ref = 4095, motor_low = 0;
  int motor0 = -1;  // place of the first motor in a main frame

  // The `which`-th number of a setting, separated by commas or a slash.
  double Number(std::string_view setting, std::size_t which, double fallback) const;
  int IndexOf(char frame, std::string_view field) const;  // -1 if there is none
  // Whether the loop's iteration is logged as a main frame.
  bool Logs(std::uint32_t iteration) const;

 private:
  bool TakeFrame(char frame, std::string_view property, std::string_view values);

  // An I frame every `intra_` iterations; of every `of_` iterations `count_` are logged.
  std::uint32_t intra_ = 32, count_ = 1, of_ = 1;
};

// A quantity in a known unit, made of the raw integer of another name.
struct BlackboxDerived {
  std::string raw, name, unit;
  double scale = 1.0, shift = 0.0;
};
std::vector<BlackboxDerived> DerivedBlackboxFields(const BlackboxHeader& header);

// Messages are rows of 64-bit numbers: the time of the last main frame (us), then the frame's
// fields. In main frames (`frame` I), gyro[k] (deg/s), accel[k] (g), throttle[k] (0 to 1), rotor[k]
// (rad/s) and battery (V) follow from the raw integers by the header's settings.
std::unique_ptr<MessageDecoder> MakeBlackboxDecoder(const BlackboxHeader& header, char frame);

// Encodings and predictors of Betaflight blackbox frames ("Blackbox Internals").

using BlackboxValues = std::vector<std::int64_t>;

// What predictors refer to.
struct BlackboxHistory {
  const BlackboxValues* previous = nullptr;   // main frames before
  const BlackboxValues* previous2 = nullptr;  // and before that
  std::uint32_t skipped = 0;                  // iterations not logged since the last main frame
  std::int64_t home[2] = {0, 0};
  std::int64_t main_time = 0;  // us, of the last main frame
};

// The numbers of the frame at the cursor, after its letter. The cursor's ok() turns false where the
// data end first.
void DecodeBlackboxFrame(const BlackboxHeader& header, char frame, const BlackboxHistory& history,
                         ByteCursor* cursor, BlackboxValues* values);

std::uint32_t ReadBlackboxUnsigned(ByteCursor* cursor);  // 7 bits a byte, low first
std::int32_t ReadBlackboxSigned(ByteCursor* cursor);     // the same in zigzag

}  // namespace trueline
