#include <fmt/format.h>

#include <algorithm>

#include "problems/import/formats/blackbox_header.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"

namespace trueline {
namespace {

constexpr std::size_t kMaxFrame = 1 << 13;         // bytes
constexpr std::size_t kMaxHeaderLine = 1 << 16;    // bytes
constexpr std::int64_t kMaxTimeJump = 10'000'000;  // us
constexpr std::int64_t kMaxIterationJump = 5000;
constexpr std::int64_t kTimeWrap = 1LL << 32;  // us

// The frames of one session.
class BlackboxSession {
 public:
  BlackboxSession(ByteFile* file, int number, MessageSink* sink)
      : file_(file), sink_(sink), number_(number) {}

  // False if the header makes no sense; the file is after it then.
  bool ReadHeader() {
    bool good = true;
    for (std::string_view line; NextLine(&line);) good &= header_.AddLine(line);
    if (!good || !header_.Finish() || header_.Number("Data version", 0, 2) != 2) return false;
    time_field_ = header_.IndexOf('I', "time");
    iteration_field_ = header_.IndexOf('I', "loopIteration");
    if (time_field_ < 0 || iteration_field_ < 0) return false;
    AddChannel('I', "main");
    AddChannel('S', "slow");
    AddChannel('G', "gps");
    return true;
  }

  void ReadFrames() {
    while (!ended_ && ReadFrame()) {
    }
    if (damaged_ > 0) {
      sink_->Warn(
          fmt::format("session {}: {} damaged places, the first at byte {}; {} main frames "
                      "are left out, up to the next I frame each",
                      number_, damaged_, first_damaged_, unusable_));
    }
    if (homeless_ > 0) {
      sink_->Warn(fmt::format("session {}: {} GPS frames {}; they are left out", number_, homeless_,
                              knows_home_ ? "come before the home position to which they refer"
                                          : "refer to a home position, which the log lacks"));
    }
  }

  std::size_t main_frames() const { return main_frames_; }

 private:
  bool NextLine(std::string_view* line) {
    std::string_view bytes;
    file_->Peek(kMaxHeaderLine, &bytes);
    const std::size_t end = bytes.find('\n');
    if (!bytes.starts_with("H ") || end == std::string_view::npos) return false;
    const bool next_session = started_ && bytes.starts_with(kBlackboxStart);
    if (next_session) return false;
    started_ = true;
    *line = bytes.substr(2, end - 2);
    file_->Seek(file_->position() + end + 1);
    return true;
  }

  void AddChannel(char frame, const char* name) {
    if (!header_.frames.contains(frame)) return;
    channels_[frame] = sink_->AddChannel({name, number_ - 1, ""},
                                         [&] { return MakeBlackboxDecoder(header_, frame); });
  }

  // Whether the byte starts a frame of this session.
  bool IsFrame(char letter) const { return letter == 'E' || header_.frames.contains(letter); }

  bool ReadFrame() {
    std::string_view bytes;
    file_->Peek(kMaxFrame, &bytes);
    if (bytes.empty() || bytes.starts_with(kBlackboxStart)) return false;
    const std::uint64_t start = file_->position();
    ByteCursor cursor(bytes);
    const char letter = cursor.Get<char>();
    bool good = IsFrame(letter) && Decode(letter, &cursor);
    if (good && !ended_ && cursor.left() > 0) {
      const std::string_view next = bytes.substr(cursor.at());
      good = IsFrame(next.front()) || next.starts_with(kBlackboxStart);
    }
    if (!good) {
      if (!lost_ && damaged_++ == 0) first_damaged_ = start;
      lost_ = true;
      valid_ = false;
      file_->Seek(start + 1);
      return true;
    }
    lost_ = false;
    Accept(letter);
    file_->Seek(start + cursor.at());
    return true;
  }

  // Into values_; nothing else changes, so that a damaged frame leaves no trace.
  bool Decode(char letter, ByteCursor* cursor) {
    if (letter == 'E') return DecodeEvent(cursor);
    BlackboxHistory history{nullptr, nullptr, 0, {home_[0], home_[1]}, last_time_};
    if (letter == 'P') {
      history.previous = &previous_;
      history.previous2 = &previous2_;
      history.skipped = Skipped();
    }
    DecodeBlackboxFrame(header_, letter, history, cursor, &values_);
    return cursor->ok();
  }

  // Iterations after the last main frame that are not logged.
  std::uint32_t Skipped() const {
    if (last_iteration_ < 0) return 0;
    auto iteration = static_cast<std::uint32_t>(last_iteration_ + 1);
    std::uint32_t skipped = 0;
    while (!header_.Logs(iteration) && skipped < kMaxIterationJump) ++iteration, ++skipped;
    return skipped;
  }

  bool DecodeEvent(ByteCursor* cursor) {
    event_ = cursor->Get<std::uint8_t>();
    switch (event_) {
      case 0:   // beep: time
      case 15:  // disarmed: reason
        ReadBlackboxUnsigned(cursor);
        break;
      case 13:  // adjustment in flight; bit 7: a float
        cursor->Get<std::uint8_t>() < 128 ? static_cast<void>(ReadBlackboxSigned(cursor))
                                          : static_cast<void>(cursor->Bytes(4));
        break;
      case 14:  // logging resumed: iteration and time
        resumed_iteration_ = ReadBlackboxUnsigned(cursor);
        resumed_time_ = ReadBlackboxUnsigned(cursor);
        break;
      case 30:  // flight mode: new and old flags
        ReadBlackboxUnsigned(cursor);
        ReadBlackboxUnsigned(cursor);
        break;
      case 40:  // the attitude filter failed (INAV): kind of failure
        ReadBlackboxUnsigned(cursor);
        break;
      case 255:
        // Newer firmware adds the reason for disarming.
        ended_ = cursor->Until('\0').starts_with("End of log") && cursor->ok();
        return ended_;
      default:
        return false;
    }
    return cursor->ok();
  }

  void Accept(char letter) {
    if (letter == 'I' || letter == 'P') {
      AcceptMain(letter);
    } else if (letter == 'H') {
      for (std::size_t i = 0; i < 2 && i < values_.size(); ++i) home_[i] = values_[i];
      knows_home_ = true;
    } else if (letter == 'G' && !knows_home_ && RefersToHome()) {
      ++homeless_;
    } else if (letter == 'S' || letter == 'G') {
      Emit(letter);
    } else if (letter == 'E' && event_ == 14) {
      last_iteration_ = resumed_iteration_;
      last_time_ = UnwrapAfterGap(resumed_time_, resumed_iteration_);
    }
  }

  bool RefersToHome() const {
    constexpr int kHomePredictor = 7;
    const std::vector<BlackboxField>& fields = header_.frames.at('G');
    return std::any_of(fields.begin(), fields.end(), [](const BlackboxField& field) {
      return field.predictor == kHomePredictor;
    });
  }

  // The log states times modulo 2^32 us, which is 71 minutes. After a gap of any length they have
  // wrapped if they went back where the loop's iterations went on.
  std::int64_t UnwrapAfterGap(std::int64_t logged, std::int64_t iteration) const {
    const std::int64_t time = accepted_time_ - Logged(accepted_time_) + Logged(logged);
    const bool wrapped = time < accepted_time_ && iteration > accepted_iteration_;
    return wrapped ? time + kTimeWrap : time;
  }

  // The time nearest to that of the last main frame, once there is one.
  std::int64_t UnwrapNear(std::int64_t logged) const {
    if (last_time_ == 0) return Logged(logged);
    return last_time_ + static_cast<std::int32_t>(Logged(logged) - Logged(last_time_));
  }

  static std::uint32_t Logged(std::int64_t time) { return static_cast<std::uint32_t>(time); }

  void AcceptMain(char letter) {
    const std::int64_t logged = values_[static_cast<std::size_t>(time_field_)];
    const std::int64_t iteration = values_[static_cast<std::size_t>(iteration_field_)];
    if (letter == 'P' && !valid_) {
      ++unusable_;
      return;
    }
    const bool known = last_iteration_ >= 0;
    const std::int64_t time = known ? UnwrapNear(logged) : UnwrapAfterGap(logged, iteration);
    if (known && (time < last_time_ || time - last_time_ > kMaxTimeJump ||
                  iteration < last_iteration_ || iteration - last_iteration_ > kMaxIterationJump)) {
      valid_ = false;
      last_iteration_ = -1;  // the next I frame is accepted
      ++unusable_;
      return;
    }
    valid_ = true;
    last_time_ = accepted_time_ = time;
    last_iteration_ = accepted_iteration_ = iteration;
    previous2_ = letter == 'I' ? values_ : previous_;
    previous_ = values_;
    ++main_frames_;
    Emit('I');
  }

  void Emit(char frame) {
    const auto channel = channels_.find(frame);
    if (channel == channels_.end()) return;
    row_.assign(1, last_time_);
    row_.insert(row_.end(), values_.begin(), values_.end());
    const int time = header_.IndexOf(frame, "time");
    if (time >= 0) {
      std::int64_t& logged = row_[static_cast<std::size_t>(time) + 1];
      logged = UnwrapNear(logged);
    }
    const char* bytes = reinterpret_cast<const char*>(row_.data());
    sink_->Add(channel->second, last_time_ * 1000, {bytes, 8 * row_.size()});
  }

  ByteFile* file_;
  MessageSink* sink_;
  int number_;  // from 1
  BlackboxHeader header_;
  bool started_ = false, ended_ = false;
  int time_field_ = -1, iteration_field_ = -1;
  std::map<char, std::size_t> channels_;

  BlackboxValues values_, previous_, previous2_, row_;
  bool valid_ = false;  // P frames have what they refer to
  bool lost_ = false;
  std::int64_t last_time_ = 0;            // us, unwrapped
  std::int64_t last_iteration_ = -1;      // none
  std::int64_t accepted_time_ = 0;        // us, unwrapped, of the last main frame that was used
  std::int64_t accepted_iteration_ = -1;  // its iteration; -1: there is none
  std::int64_t home_[2] = {0, 0};
  bool knows_home_ = false;
  int event_ = 0;
  std::int64_t resumed_iteration_ = 0, resumed_time_ = 0;

  std::size_t main_frames_ = 0, unusable_ = 0, damaged_ = 0, homeless_ = 0;
  std::uint64_t first_damaged_ = 0;
};

}  // namespace

void WalkBlackbox(const std::filesystem::path& path, MessageSink* sink) {
  ByteFile file(path);
  std::size_t longest = 0;
  int number = 0;
  while (file.Find(kBlackboxStart)) {
    const std::uint64_t start = file.position();
    BlackboxSession session(&file, ++number, sink);
    if (!session.ReadHeader()) {
      sink->Warn(
          fmt::format("the header of session {} at byte {} is malformed, or of a data version "
                      "other than 2; the session is left out",
                      number, start));
      file.Seek(start + 1);
      continue;
    }
    session.ReadFrames();
    if (number > 1 && session.main_frames() > longest) sink->Prefer(number - 1);
    longest = std::max(longest, session.main_frames());
  }
}

}  // namespace trueline
