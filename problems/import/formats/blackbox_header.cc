#include "problems/import/formats/blackbox_header.h"

#include <algorithm>
#include <cmath>

#include "problems/log/csv_text.h"

namespace trueline {
namespace {

constexpr std::size_t kMaxBlackboxFields = 1024;

bool ParseSmall(std::string_view text, int* number) {
  double value = 0.0;
  if (!ParseNumber(text, &value) || !(std::abs(value) < 1e6)) return false;
  *number = static_cast<int>(value);
  return true;
}

}  // namespace

bool BlackboxHeader::AddLine(std::string_view line) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return false;
  const std::string_view name = line.substr(0, colon);
  const std::string_view value = line.substr(colon + 1);
  if (!name.starts_with("Field ") || name.size() < 9) {
    settings[std::string(name)] = value;
    return true;
  }
  return TakeFrame(name[6], name.substr(8), value);
}

bool BlackboxHeader::TakeFrame(char frame, std::string_view property, std::string_view values) {
  std::vector<std::string_view> texts;
  SplitFields(values, ',', &texts);
  if (texts.size() > kMaxBlackboxFields) return false;
  std::vector<BlackboxField>& fields = frames[frame];
  if (frame == 'P' && fields.empty()) fields = frames['I'];
  if (property == "name") fields.resize(texts.size());
  if (texts.size() != fields.size()) return false;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    int number = 0;
    if (property == "name") {
      fields[i].name = texts[i];
      continue;
    }
    if (!ParseSmall(texts[i], &number)) return false;
    if (property == "signed") fields[i].is_signed = number != 0;
    if (property == "predictor") fields[i].predictor = number;
    if (property == "encoding") fields[i].encoding = number;
  }
  return true;
}

bool BlackboxHeader::Finish() {
  const auto whole = [this](const char* setting, std::size_t which, double fallback) {
    return static_cast<int>(std::clamp(Number(setting, which, fallback), 0.0, 1e6));
  };
  min_throttle = whole("minthrottle", 0, 1150);
  vbat_ref = whole("vbatref", 0, 4095);
  motor_low = whole("motorOutput", 0, 0);
  motor0 = IndexOf('I', "motor[0]");
  // "P interval" is one number, or a ratio such as 1/2.
  const int first = std::max(1, whole("P interval", 0, 1));
  const int second = whole("P interval", 1, 0);
  intra_ = static_cast<std::uint32_t>(std::max(1, whole("I interval", 0, 32)));
  count_ = static_cast<std::uint32_t>(second > 0 ? first : 1);
  of_ = static_cast<std::uint32_t>(second > 0 ? second : first);
  const std::vector<BlackboxField>& intra = frames['I'];
  const std::vector<BlackboxField>& inter = frames['P'];
  if (intra.empty() || inter.size() != intra.size()) return false;
  const auto known = [](const BlackboxField& field) {
    const bool encoding = field.encoding == 0 || field.encoding == 1 || field.encoding == 3 ||
                          (field.encoding >= 6 && field.encoding <= 10);
    return encoding && field.predictor >= 0 && field.predictor <= 11;
  };
  return std::all_of(frames.begin(), frames.end(), [&](const auto& frame) {
    return std::all_of(frame.second.begin(), frame.second.end(), known);
  });
}

double BlackboxHeader::Number(std::string_view setting, std::size_t which, double fallback) const {
  const auto found = settings.find(setting);
  if (found == settings.end()) return fallback;
  std::string text = found->second;
  std::replace(text.begin(), text.end(), '/', ',');
  std::vector<std::string_view> parts;
  SplitFields(text, ',', &parts);
  double value = 0.0;
  return which < parts.size() && ParseNumber(parts[which], &value) ? value : fallback;
}

int BlackboxHeader::IndexOf(char frame, std::string_view field) const {
  const auto found = frames.find(frame);
  if (found == frames.end()) return -1;
  for (std::size_t i = 0; i < found->second.size(); ++i) {
    if (found->second[i].name == field) return static_cast<int>(i);
  }
  return -1;
}

bool BlackboxHeader::Logs(std::uint32_t iteration) const {
  return (iteration % intra_ + count_ - 1) % of_ < count_;
}

}  // namespace trueline
