#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "problems/common/error.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/recording.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"
#include "problems/log/unpacked.h"

namespace trueline {
namespace {

// Message types of a DataFlash log, as its FMT records define them.

constexpr std::size_t kFlashShorts = 32;  // of letter 'a'

// A letter of a format that stands for one number.
struct FlashLetter {
  char letter;
  Scalar type;
  double scale = 1.0;
};
const FlashLetter kFlashLetters[] = {
    {'b', Scalar::kI8},        {'B', Scalar::kU8},        {'M', Scalar::kU8},
    {'h', Scalar::kI16},       {'H', Scalar::kU16},       {'i', Scalar::kI32},
    {'I', Scalar::kU32},       {'q', Scalar::kI64},       {'Q', Scalar::kU64},
    {'f', Scalar::kF32},       {'d', Scalar::kF64},       {'g', Scalar::kF16},
    {'c', Scalar::kI16, 0.01}, {'C', Scalar::kU16, 0.01}, {'e', Scalar::kI32, 0.01},
    {'E', Scalar::kU32, 0.01}, {'L', Scalar::kI32, 1e-7}};

// Null for texts and lists.
const FlashLetter* LetterOf(char letter) {
  const auto* found = std::ranges::find(kFlashLetters, letter, &FlashLetter::letter);
  return found == std::end(kFlashLetters) ? nullptr : found;
}

// Bytes; 0 if the letter stands for no text.
std::size_t FlashTextSize(char letter) {
  return letter == 'n' ? 4 : letter == 'N' ? 16 : letter == 'Z' ? 64 : 0;
}

std::size_t LetterSize(char letter) {
  if (letter == 'a') return 2 * kFlashShorts;
  const FlashLetter* known = LetterOf(letter);
  return known == nullptr ? FlashTextSize(letter) : SizeOf(known->type);
}

// To the first zero.
std::string FlashText(std::string_view bytes) {
  return std::string(bytes.substr(0, bytes.find('\0')));
}

struct FlashColumn {
  std::string name;
  char letter;
  std::size_t offset;  // in the record, bytes
};

struct FlashType {
  std::string name;
  std::size_t length = 0;  // of a record, with its three bytes of header
  std::vector<FlashColumn> columns;
  std::string units, multipliers;  // a letter for each column
  int instance_column = -1;        // tells sensors apart
  int time_column = -1;
  std::map<int, std::size_t> channels;  // by instance

  const FlashColumn* Find(std::string_view column) const {
    const auto found = std::ranges::find(columns, column, &FlashColumn::name);
    return found == columns.end() ? nullptr : &*found;
  }
};

bool TellsSensorsApart(const FlashType& type, const FlashColumn& column) {
  if (column.letter != 'B') return false;
  const bool core = type.name.starts_with("XK") || type.name.starts_with("NK");
  return column.name == "I" || column.name == "Inst" || column.name == "Instance" ||
         (core && column.name == "C");
}

// The type that an FMT record defines. False if its columns do not fit its length.
bool ParseFmt(std::string_view record, FlashType* type) {
  ByteCursor cursor(record.substr(4));
  type->length = cursor.Get<std::uint8_t>();
  type->name = FlashText(cursor.Bytes(4));
  const std::string letters = FlashText(cursor.Bytes(16));
  std::size_t offset = 3;
  std::string rest = FlashText(cursor.Bytes(64));
  for (const char letter : letters) {
    const std::size_t comma = rest.find(',');
    if (LetterSize(letter) == 0) return false;
    type->columns.push_back({rest.substr(0, comma), letter, offset});
    rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
    offset += LetterSize(letter);
  }
  for (std::size_t i = 0; i < type->columns.size(); ++i) {
    const FlashColumn& column = type->columns[i];
    if (TellsSensorsApart(*type, column)) type->instance_column = static_cast<int>(i);
    const bool is_time = column.name == "TimeUS" || column.name == "TimeMS";
    if (is_time && i == 0 && LetterOf(column.letter) != nullptr) type->time_column = 0;
  }
  return offset == type->length;
}

constexpr std::string_view kRecordMagic("\xA3\x95", 2);
constexpr std::uint8_t kFmtType = 128;
constexpr std::size_t kFmtLength = 89;
constexpr std::size_t kMostDefinitions = 64;  // of one number

// The columns of a type. A log of two starts may define a name, or a number, again with others.
std::string LayoutOf(const FlashType& type) {
  std::string layout;
  for (const FlashColumn& column : type.columns) layout += column.name + column.letter + ",";
  return layout;
}

// A number's definitions in a log, of which the last one that was read is valid.
class FlashDefinitions {
 public:
  FlashType& Now() { return types_[now_]; }
  void Restart() { now_ = 0; }
  // True if there was another one.
  bool Define(FlashType type) {
    const auto same = std::find_if(types_.begin(), types_.end(), [&](const FlashType& one) {
      return one.name == type.name && LayoutOf(one) == LayoutOf(type);
    });
    if (same == types_.end() && types_.front().length == 0) {
      types_.front() = std::move(type);
      return false;
    }
    if (same == types_.end() && types_.size() >= kMostDefinitions) return false;  // damage
    const std::size_t before = now_;
    now_ = static_cast<std::size_t>(same - types_.begin());
    if (same == types_.end()) types_.push_back(std::move(type));
    return now_ != before;
  }

 private:
  std::vector<FlashType> types_ = std::vector<FlashType>(1);  // in order; one of length 0: none
  std::size_t now_ = 0;
};

class FlashWalk {
 public:
  FlashWalk(const std::filesystem::path& path, MessageSink* sink) : file_(path), sink_(sink) {}

  void Run() {
    ReadDefinitions();
    FindLongestPart();
    ForEachRecord([&](FlashType& type, std::string_view record) {
      const std::uint64_t start = file_.position() - record.size();
      if (start >= from_ && start < to_) Emit(type, record);
    });
    sink_->WarnOf(untimed_, "records have no possible time stamp; they are left out");
    if (skipped_ > 0) {
      sink_->Warn(
          fmt::format("{} bytes in {} places are no records, the first at byte {}; they are "
                      "left out",
                      skipped_, places_, first_skipped_));
    }
  }

 private:
  template <class Visit>
  void ForEachRecord(const Visit& visit) {
    file_.Seek(0);
    for (FlashDefinitions& definitions : types_) definitions.Restart();
    skipped_ = places_ = 0;
    bool lost = false;
    for (std::string_view head; file_.Peek(3, &head);) {
      const auto id = static_cast<std::uint8_t>(head[2]);
      const std::size_t length = id == kFmtType ? kFmtLength : types_[id].Now().length;
      if (head.substr(0, 2) != kRecordMagic || length < 3) {
        Skip(&lost);
        continue;
      }
      std::string_view record;
      if (!file_.Read(length, &record)) break;  // the usual end of a log
      lost = false;
      if (id == kFmtType) Define(record);
      visit(types_[id].Now(), record);
    }
  }

  // On to the next magic bytes.
  void Skip(bool* lost) {
    const std::uint64_t from = file_.position();
    file_.Seek(from + 1);
    file_.Find(kRecordMagic);
    if (!*lost && places_++ == 0) first_skipped_ = from;
    *lost = true;
    skipped_ += file_.position() - from;
  }

  void Define(std::string_view record) {
    const auto id = static_cast<std::uint8_t>(record[3]);
    FlashType type;
    if (!ParseFmt(record, &type) || (id == kFmtType && type.length != kFmtLength)) return;
    const std::uint64_t start = file_.position() - record.size();
    if (types_[id].Define(std::move(type))) redefined_.push_back(start);
  }

  // Types that are defined again with other columns are those of another log in the same file,
  // whose times are others: one of them is read.
  void FindLongestPart() {
    to_ = file_.size();
    if (redefined_.empty()) return;
    std::vector<std::uint64_t> ends = redefined_;
    ends.push_back(file_.size());
    std::uint64_t begin = 0, longest = 0;
    for (const std::uint64_t end : ends) {
      if (end - begin > longest) {
        longest = end - begin;
        from_ = begin;
        to_ = end;
      }
      begin = end;
    }
    sink_->Warn(fmt::format(
        "types are defined again with other columns from byte {} on, as by another start of the "
        "logger: the longest part is read, from byte {} to {}; cut the file there to read the rest",
        redefined_.front(), from_, to_));
  }

  void ReadDefinitions() {
    ForEachRecord([&](const FlashType& type, std::string_view record) {
      if (type.name == "UNIT") {
        units_[LetterIn(type, record)] = TextIn(type, record, "Label");
      } else if (type.name == "MULT") {
        const FlashColumn* value = type.Find("Mult");
        if (value != nullptr && value->letter == 'd') {
          multipliers_[LetterIn(type, record)] = LoadLittle<double>(record.data() + value->offset);
        }
      } else if (type.name == "FMTU") {
        const FlashColumn* of = type.Find("FmtType");
        if (of == nullptr) return;
        FlashType& target = types_[static_cast<std::uint8_t>(record[of->offset])].Now();
        target.units = TextIn(type, record, "UnitIds");
        target.multipliers = TextIn(type, record, "MultIds");
      }
    });
  }

  static char LetterIn(const FlashType& type, std::string_view record) {
    const FlashColumn* id = type.Find("Id");
    return id == nullptr ? '\0' : record[id->offset];
  }
  static std::string TextIn(const FlashType& type, std::string_view record,
                            std::string_view column) {
    const FlashColumn* text = type.Find(column);
    if (text == nullptr) return "";
    return FlashText(record.substr(text->offset, FlashTextSize(text->letter)));
  }

  void Emit(FlashType& type, std::string_view record) {
    if (type.length == 0) return;
    int instance = 0;
    if (type.instance_column >= 0) {
      const FlashColumn& column = type.columns[static_cast<std::size_t>(type.instance_column)];
      instance = static_cast<std::uint8_t>(record[column.offset]);
    }
    auto [channel, is_new] = type.channels.try_emplace(instance, 0);
    if (is_new) {
      channel->second = sink_->AddChannel({type.name, instance, "", LayoutOf(type)},
                                          [&] { return MakeDecoder(type); });
    }
    TimeNs time = 0;
    if (type.time_column >= 0) {
      const FlashColumn& column = type.columns.front();
      const bool us = column.name == "TimeUS";
      const Cell cell = ReadScalar(LetterOf(column.letter)->type, record.data() + column.offset);
      if (!cell.Time(us ? 3 : 6, &time)) {
        ++untimed_;
        return;
      }
    }
    sink_->Add(channel->second, time, record);
  }

  std::unique_ptr<MessageDecoder> MakeDecoder(const FlashType& type) const {
    std::vector<PackedField> fields;
    for (std::size_t i = 0; i < type.columns.size(); ++i) {
      const FlashColumn& column = type.columns[i];
      if (column.letter == 'a') {
        for (std::size_t k = 0; k < kFlashShorts; ++k) {
          fields.push_back(
              {fmt::format("{}[{}]", column.name, k), column.offset + 2 * k, Scalar::kI16});
        }
      }
      const FlashLetter* letter = LetterOf(column.letter);
      if (letter != nullptr) fields.push_back(MakeField(type, i, *letter));
    }
    const bool timed = type.time_column >= 0;
    const std::string stamp = timed ? type.columns.front().name : "";
    return std::make_unique<PackedDecoder>(fields, type.length, stamp, stamp == "TimeMS" ? 6 : 3);
  }

  PackedField MakeField(const FlashType& type, std::size_t i, const FlashLetter& letter) const {
    const FlashColumn& column = type.columns[i];
    PackedField field{column.name, column.offset, letter.type, "", letter.scale};
    if (column.name == "TimeUS" || column.name == "TimeMS") {
      field.unit = column.name == "TimeUS" ? "us" : "ms";
      field.scale = 1.0;
      return field;
    }
    const auto unit = i < type.units.size() ? units_.find(type.units[i]) : units_.end();
    if (unit != units_.end()) field.unit = unit->second;
    // '-' and '?' say that there is none, or that it is not known.
    const char id = i < type.multipliers.size() ? type.multipliers[i] : '?';
    const auto multiplier = multipliers_.find(id);
    if (id != '-' && id != '?' && multiplier != multipliers_.end())
      field.scale = multiplier->second;
    return field;
  }

  ByteFile file_;
  MessageSink* sink_;
  std::array<FlashDefinitions, 256> types_;  // by number
  std::map<char, std::string> units_;
  std::map<char, double> multipliers_;
  std::vector<std::uint64_t> redefined_;  // bytes where a type has other columns from there on
  std::uint64_t from_ = 0, to_ = 0;       // bytes, of the part that is read
  std::uint64_t skipped_ = 0, first_skipped_ = 0;
  std::size_t places_ = 0, untimed_ = 0;
};

// --- The text form, which is rewritten to the binary one

template <class T>
void Append(T value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// False for a text that does not fit the letter.
bool AppendField(char letter, std::string_view text, std::string* out) {
  if (const std::size_t size = FlashTextSize(letter); size > 0) {
    out->append(text.substr(0, size)).append(size - std::min(size, text.size()), '\0');
    return true;
  }
  const FlashLetter* known = LetterOf(letter);
  double value = 0.0;
  if (known == nullptr) return false;
  if (!ParseNumber(text, &value) && letter != 'M') return false;  // modes may have names
  // Counts are written as what they mean: "-35.3632621" for -353632621 of letter L.
  const bool is_meant = known->scale != 1.0 && text.find('.') != std::string_view::npos;
  if (is_meant) value /= known->scale;
  const auto whole = [&](auto least, auto most) {
    return std::clamp(std::round(value), static_cast<double>(least), static_cast<double>(most));
  };
  switch (known->type) {
    case Scalar::kF32:
      Append(static_cast<float>(value), out);
      return true;
    case Scalar::kF64:
      Append(value, out);
      return true;
    case Scalar::kF16:
      Append(Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(static_cast<float>(value))), out);
      return true;
    case Scalar::kI64:
    case Scalar::kU64: {
      TimeNs exact = 0;
      if (!ParseTime(text, 0, &exact)) return false;
      Append(exact, out);
      return true;
    }
    default:
      break;
  }
  const bool is_signed =
      known->type == Scalar::kI8 || known->type == Scalar::kI16 || known->type == Scalar::kI32;
  const int bits = 8 * static_cast<int>(SizeOf(known->type));
  const auto number =
      static_cast<std::int64_t>(is_signed ? whole(-std::exp2(bits - 1), std::exp2(bits - 1) - 1)
                                          : whole(0, std::exp2(bits) - 1));
  out->append(reinterpret_cast<const char*>(&number), SizeOf(known->type));
  return true;
}

// Types by name, from the lines of FMT: "FMT, 162, 54, IMU, QBff, TimeUS,I,GyrX,GyrY".
struct TextType {
  std::uint8_t id;
  std::string letters;
};

bool AppendRecord(std::string_view line, std::map<std::string, TextType>* types, std::string* out) {
  std::vector<std::string_view> texts;
  SplitFields(line, ',', &texts);
  std::string record(kRecordMagic);
  if (texts.size() > 5 && texts[0] == "FMT") {
    double id = 0.0, length = 0.0;
    if (!ParseNumber(texts[1], &id) || !ParseNumber(texts[2], &length)) return false;
    (*types)[std::string(texts[3])] = {static_cast<std::uint8_t>(id), std::string(texts[4])};
    std::string columns;
    for (std::size_t i = 5; i < texts.size(); ++i) {
      columns.append(i > 5 ? "," : "").append(texts[i]);
    }
    record += static_cast<char>(kFmtType);
    record += static_cast<char>(static_cast<std::uint8_t>(id));
    record += static_cast<char>(static_cast<std::uint8_t>(length));
    AppendField('n', texts[3], &record);
    AppendField('N', texts[4], &record);
    AppendField('Z', columns, &record);
    *out += record;
    return true;
  }
  const auto type = types->find(std::string(texts[0]));
  if (type == types->end() || texts.size() < type->second.letters.size() + 1) return false;
  record += static_cast<char>(type->second.id);
  for (std::size_t i = 0; i < type->second.letters.size(); ++i) {
    if (!AppendField(type->second.letters[i], texts[i + 1], &record)) return false;
  }
  *out += record;
  return true;
}

}  // namespace

bool IsDataFlashText(std::string_view start) {
  return start.starts_with("FMT, 128, 89, FMT,") || start.starts_with("FMT,128,89,FMT,");
}

void WalkDataFlashText(const std::filesystem::path& path, MessageSink* sink) {
  const std::filesystem::path binary = TemporaryFor(path);
  std::ofstream out(binary, std::ios::binary);
  std::map<std::string, TextType> types;
  LineReader lines(path);
  std::size_t unread = 0, first = 0;
  for (std::string_view line; lines.NextFilled(&line);) {
    std::string record;
    if (!AppendRecord(line, &types, &record) && unread++ == 0) {
      first = static_cast<std::size_t>(lines.line_number());
    }
    out.write(record.data(), static_cast<std::streamsize>(record.size()));
  }
  if (!out.flush())
    throw ErrorAt(path.string(), 0, "has no room in the folder for temporary files");
  sink->WarnOf(unread, fmt::format("lines are no records of a known type, the first is line {}; "
                                   "they are left out",
                                   first));
  WalkDataFlash(binary, sink);
}

void WalkDataFlash(const std::filesystem::path& path, MessageSink* sink) {
  FlashWalk(path, sink).Run();
}

}  // namespace trueline
