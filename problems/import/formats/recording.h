// A log of any format as channels of records with named numbers.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "problems/common/units.h"

namespace trueline {

// One number of a record, without loss: 64-bit counts of nanoseconds do not fit a double.

class Cell {
 public:
  Cell() : Cell(std::numeric_limits<double>::quiet_NaN()) {}  // missing
  explicit Cell(double value) { std::memcpy(bytes_, &value, sizeof(value)); }
  explicit Cell(std::int64_t value) : whole_(true) { std::memcpy(bytes_, &value, sizeof(value)); }

  double Number() const {  // not a number where it is missing
    return whole_ ? static_cast<double>(Load<std::int64_t>()) : Load<double>();
  }
  // The number as a count of 10^exponent ns. False, and `time` as it was, if it is missing or does
  // not fit.
  bool Time(int exponent, TimeNs* time) const;
  // Equal for equal numbers of one column.
  std::string_view Bytes() const { return {bytes_, sizeof(bytes_)}; }

 private:
  template <class T>
  T Load() const {
    T value;
    std::memcpy(&value, bytes_, sizeof(value));
    return value;
  }

  char bytes_[8];
  bool whole_ = false;
};

// How a binary format stores a number.
enum class Scalar { kI8, kU8, kI16, kU16, kI32, kU32, kI64, kU64, kF16, kF32, kF64 };

std::size_t SizeOf(Scalar type);
Cell ReadScalar(Scalar type, const char* bytes);  // of SizeOf(type) bytes

struct ChannelField {
  std::string name;  // "header.stamp", "q[0]"
  std::string unit;  // where the format states one
};

struct Channel {
  std::string name;
  int instance = 0;  // of several sensors of one kind, or sessions of one file
  std::string type;
  std::vector<ChannelField> fields;
  // The field with the time of measurement and the power of ten (ns) of its unit; without it
  // records have the time of recording.
  int stamp_field = -1;
  int stamp_exponent = 0;

  std::size_t count = 0;
  TimeNs first = 0, last = 0;  // times of recording, in the file's order

  // "name", or "name[2]" for another instance than 0.
  std::string Label() const;
  double Rate() const;                          // Hz, in the mean; 0 for fewer than two records
  int IndexOf(const std::string& field) const;  // -1 if there is none
  void SetStamp(const std::string& field, int exponent);
};

struct Record {
  TimeNs time = 0;  // of measurement, where the channel states it
  // The channel states times of measurement, and this record's is zero or missing: `time` is that
  // of recording.
  bool is_unstamped = false;
  std::size_t place = 0;    // in the file: counts its messages, of all channels
  std::vector<Cell> cells;  // in the order of the channel's fields; missing ones are NaN
};

// Decodes the messages of one channel.
class MessageDecoder {
 public:
  virtual ~MessageDecoder() = default;
  // Sets the fields and the stamp from a message; elements of lists beyond those that it has are
  // left out of all messages. False if it can't be decoded.
  virtual bool Describe(std::string_view message, Channel* channel) = 0;
  // False if the message is cut or malformed. `cells` has the number of fields, all missing.
  virtual bool Decode(std::string_view message, std::vector<Cell>* cells) const = 0;
  // Whether a later message may have fields that the one given to Describe() lacks.
  virtual bool MayGrow() const { return false; }
  // Why no message of the channel is decoded, as "its type ..."; empty where they are.
  virtual std::string Refusal() const { return ""; }
};

// Two channels differ if any of these does, so that each is decoded by its own layout.
struct ChannelKey {
  std::string name;
  int instance = 0;
  std::string type;
  std::string layout = {};  // encoding and definition; equal for equal places of the numbers

  auto operator<=>(const ChannelKey&) const = default;
};

// Receives what a format's walk finds in a file.
class MessageSink {
 public:
  using MakeDecoder = std::function<std::unique_ptr<MessageDecoder>()>;

  virtual ~MessageSink() = default;
  // The index of a channel; a new one gets its decoder by `make`.
  virtual std::size_t AddChannel(const ChannelKey& key, const MakeDecoder& make) = 0;
  // `recorded` is the time of recording.
  virtual void Add(std::size_t channel, TimeNs recorded, std::string_view message) = 0;
  virtual void Warn(const std::string& warning) = 0;  // what was damaged, and where
  // "3 records ..."; nothing where none is.
  void WarnOf(std::size_t count, const std::string& what) {
    if (count > 0) Warn(std::to_string(count) + " " + what);
  }
  virtual void Prefer(int instance) = 0;  // of channels that are named without one
};

// How the records of a log follow each other: in the order of time, chunk by chunk in any order, or
// file by file.
enum class RecordOrder { kTime, kChunks, kFiles };

// A format: how it is recognised, and a function that walks through a file from its start.
struct LogFormat {
  const char* key;   // in maps
  const char* name;  // for people
  void (*walk)(const std::filesystem::path& path, MessageSink* sink);
  RecordOrder order = RecordOrder::kTime;
};

class Recording : private MessageSink {
 public:
  // Reads the log once, for its channels. Throws InputError for a file that can't be read.
  Recording(const std::filesystem::path& path, const LogFormat& format);

  const LogFormat& format() const { return format_; }
  const std::string& file() const { return file_; }
  const std::vector<Channel>& channels() const { return channels_; }
  const std::vector<std::string>& warnings() const { return warnings_; }
  std::optional<int> preferred_instance() const { return preferred_; }

  using Visitor = std::function<void(std::size_t channel, const Record& record)>;
  // Reads the log again and visits the records of the `wanted` channels, in the file's order.
  // Returns for each wanted channel the number of its messages that could not be decoded.
  std::vector<std::size_t> Visit(const std::vector<std::size_t>& wanted, const Visitor& visit);

 private:
  std::size_t AddChannel(const ChannelKey& key, const MakeDecoder& make) override;
  void Add(std::size_t channel, TimeNs recorded, std::string_view message) override;
  void Warn(const std::string& warning) override;
  void Prefer(int instance) override { preferred_ = instance; }
  void Walk();
  void Scan(std::size_t channel, TimeNs recorded, std::string_view message);
  void Describe(std::size_t channel, std::string_view message);
  void WarnOfRefusals();

  std::string file_;
  LogFormat format_;
  std::vector<Channel> channels_;
  std::vector<std::unique_ptr<MessageDecoder>> decoders_;
  std::vector<std::string> described_by_;  // while scanning: the messages that the fields are from
  std::map<ChannelKey, std::size_t> index_;
  std::vector<std::string> warnings_;
  std::optional<int> preferred_;

  const Visitor* visit_ = nullptr;  // null while scanning
  std::vector<bool> wanted_;
  std::vector<std::size_t> undecoded_;
  Record record_;
};

// Numbers with their names, for encodings whose messages differ in their parts.

struct NamedCell {
  std::string name;
  Cell cell;
  bool is_time = false;  // ns
};

class NamedFields {
 public:
  // The fields of a first message; "timestamp" or "header.stamp", where it is a time, is the stamp.
  bool Describe(const std::vector<NamedCell>& row, Channel* channel);
  // Puts the numbers that Describe() has seen to their places.
  void Place(const std::vector<NamedCell>& row, std::vector<Cell>* cells) const;

 private:
  std::unordered_map<std::string, std::size_t> places_;
};

// Decodes an encoding by its messages' rows of named numbers.
class NamedRowDecoder : public MessageDecoder {
 public:
  bool Describe(std::string_view message, Channel* channel) override {
    std::vector<NamedCell> row;
    return Parse(message, &row) && fields_.Describe(row, channel);
  }
  bool MayGrow() const override { return true; }  // lists, and keys of JSON
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    std::vector<NamedCell> row;
    if (!Parse(message, &row)) return false;
    fields_.Place(row, cells);
    return true;
  }

 private:
  // False for a message that can't be read.
  virtual bool Parse(std::string_view message, std::vector<NamedCell>* row) const = 0;

  NamedFields fields_;
};

inline constexpr int kMaxNamedDepth = 16;
inline constexpr std::size_t kMaxNamedElements = 64;  // of one list
inline constexpr std::size_t kMaxNamedCells = 4096;   // of one message
inline constexpr std::size_t kMaxNamedParts = 65536;  // likewise, with what has no number

}  // namespace trueline
