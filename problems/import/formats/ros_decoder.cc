#include "problems/import/formats/ros_decoder.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/import/formats/bytes.h"
#include "problems/import/formats/ros_types.h"

namespace trueline {
namespace {

constexpr std::size_t kMaxListed = 64;    // numbers of one list that become fields
constexpr std::size_t kMaxElements = 8;   // likewise, messages
constexpr std::size_t kMaxLeaves = 4096;  // fields of one channel
constexpr int kMaxDepth = 24;
// Messages without bytes can nest in each other so often that a walk through them never ends.
constexpr std::size_t kMaxParts = 65536;  // of one type, numbers and messages, lists with each part
constexpr std::size_t kStepsOfByte = 64;  // of one message, beside those of its type

// Reads primitives in either encoding. In CDR each is aligned to its own size, counted from after
// the four bytes of encapsulation.
class RosWire {
 public:
  RosWire(std::string_view message, bool cdr) : bytes_(message), cdr_(cdr) {
    if (!cdr) return;
    if (message.size() < 4 || message[0] != 0) {
      ok_ = false;
      return;
    }
    const auto kind = static_cast<unsigned char>(message[1]);
    ok_ = kind <= 1 || kind == 6 || kind == 7;  // plain CDR, of XCDR 1 or 2
    swap_ = kind % 2 == 0;
    max_align_ = kind >= 6 ? 4 : 8;
    bytes_.remove_prefix(4);
  }

  Cell Number(Scalar type) {
    const std::size_t size = SizeOf(type);
    const std::string_view raw = Aligned(size, size);
    if (!ok_) return Cell();
    if (!swap_) return ReadScalar(type, raw.data());
    char swapped[8];
    std::reverse_copy(raw.begin(), raw.end(), swapped);
    return ReadScalar(type, swapped);
  }
  std::uint32_t Count() {
    const Cell count = Number(Scalar::kU32);
    return ok_ ? static_cast<std::uint32_t>(count.Number()) : 0;
  }
  // Nanoseconds. ROS 1 has unsigned seconds, ROS 2 signed ones.
  Cell Time() {
    const Cell seconds = Number(cdr_ ? Scalar::kI32 : Scalar::kU32);
    const Cell nanoseconds = Number(Scalar::kU32);
    if (!ok_) return Cell();
    return Cell(static_cast<std::int64_t>(seconds.Number()) * kNsPerSecond +
                static_cast<std::int64_t>(nanoseconds.Number()));
  }
  void SkipText(std::size_t width) { Aligned(0, std::uint64_t{Count()} * width); }
  void SkipNumbers(Scalar type, std::uint64_t count) {
    if (count > 0) Aligned(SizeOf(type), count * SizeOf(type));
  }
  void Fail() { ok_ = false; }
  // Counts parts that are about to be visited. False, and no more is read, where they are too many.
  bool Visit(std::size_t parts) {
    steps_ += parts;
    if (steps_ > kMaxParts + kStepsOfByte * bytes_.size()) Exhaust();
    return ok_;
  }
  void Exhaust() {
    ok_ = false;
    exhausted_ = true;
  }

  bool ok() const { return ok_; }
  bool exhausted() const { return exhausted_; }
  bool cdr() const { return cdr_; }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::string_view Aligned(std::size_t size, std::uint64_t count) {
    if (cdr_ && size > 1) {
      const std::size_t align = std::min(size, max_align_);
      const std::size_t gap = (align - at_ % align) % align;
      if (gap > left()) ok_ = false;
      if (ok_) at_ += gap;
    }
    if (!ok_ || count > left()) {
      ok_ = false;
      return {};
    }
    const std::string_view raw = bytes_.substr(at_, count);
    at_ += count;
    return raw;
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::size_t steps_ = 0;
  std::size_t max_align_ = 8;
  bool cdr_ = false, swap_ = false, ok_ = true, exhausted_ = false;
};

// What of a value becomes fields, fixed by the channel's first message: a number is one leaf, a
// message or list has a node for each of its parts.
struct RosNode {
  std::size_t leaves = 0;
  std::vector<RosNode> parts;
};

// Receives the numbers of the leaves.
struct RosOutput {
  std::vector<Cell>* cells = nullptr;
  std::size_t next = 0;

  void Put(const Cell& cell) {
    if (cells != nullptr && next < cells->size()) (*cells)[next] = cell;
    ++next;
  }
};

class RosDecoder : public MessageDecoder {
 public:
  RosDecoder(const std::string& type, const std::string& definition, bool cdr)
      : type_(RosTypeName(type)), cdr_(cdr) {
    if (definition.empty()) {
      types_ = CommonRosTypes();
    } else if (!ParseRosDefinition(type, definition, &types_)) {
      types_.clear();
    }
  }

  bool Describe(std::string_view message, Channel* channel) override {
    if (too_many_) return false;
    RosWire wire(message, cdr_);
    std::vector<std::string> names;
    root_ = {};
    nodes_ = 0;
    const bool good = DescribeMessage(type_, "", 0, &wire, &root_, &names);
    too_many_ = wire.exhausted();
    if (!good || names.empty()) return false;
    for (const std::string& name : names) channel->fields.push_back({name, ""});
    for (const char* stamp : {"header.stamp", "stamp", "timestamp"}) {
      if (channel->stamp_field < 0 && times_.contains(stamp)) channel->SetStamp(stamp, 0);
    }
    for (ChannelField& field : channel->fields) {
      if (times_.contains(field.name)) field.unit = "ns";
    }
    return true;
  }

  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    if (too_many_) return false;
    RosWire wire(message, cdr_);
    RosOutput output{cells};
    DecodeMessage(type_, &wire, &root_, &output, 0);
    too_many_ = wire.exhausted();
    return wire.ok();
  }

  bool MayGrow() const override { return may_grow_; }
  std::string Refusal() const override {
    if (!too_many_) return "";
    return fmt::format("its type {} has more than {} parts", type_, kMaxParts);
  }

 private:
  const std::vector<RosField>* Fields(const std::string& type, int depth, RosWire* wire) const {
    const auto found = types_.find(type);
    if (found != types_.end() && depth < kMaxDepth) return &found->second;
    wire->Fail();
    return nullptr;
  }

  // --- The first message: nodes and names.
  bool DescribeMessage(const std::string& type, const std::string& prefix, int depth, RosWire* wire,
                       RosNode* node, std::vector<std::string>* names) {
    const std::vector<RosField>* fields = Fields(type, depth, wire);
    if (fields == nullptr) return false;
    const std::size_t before = names->size();
    nodes_ += fields->size();
    if (nodes_ > kMaxParts) wire->Exhaust();
    if (!wire->Visit(fields->size())) return false;
    node->parts.resize(fields->size());
    for (std::size_t i = 0; i < fields->size() && wire->ok(); ++i) {
      DescribeField((*fields)[i], prefix + (*fields)[i].name, depth, wire, &node->parts[i], names);
    }
    if (fields->empty() && cdr_) wire->SkipNumbers(Scalar::kU8, 1);
    node->leaves = names->size() - before;
    return wire->ok();
  }

  void DescribeField(const RosField& field, const std::string& name, int depth, RosWire* wire,
                     RosNode* node, std::vector<std::string>* names) {
    if (!field.is_list) return DescribeOne(field, name, depth, wire, node, names);
    const std::uint64_t count = field.length ? *field.length : wire->Count();
    const std::size_t before = names->size();
    const std::size_t most = field.kind == RosKind::kMessage ? kMaxElements : kMaxListed;
    const std::uint64_t listed =
        names->size() < kMaxLeaves ? std::min<std::uint64_t>(count, most) : 0;
    may_grow_ |= !field.length;
    nodes_ += listed;
    for (std::uint64_t i = 0; i < listed && wire->ok(); ++i) {
      node->parts.emplace_back();
      DescribeOne(field, fmt::format("{}[{}]", name, i), depth, wire, &node->parts.back(), names);
    }
    SkipElements(field, count - listed, depth, wire);
    node->leaves = names->size() - before;
  }

  void DescribeOne(const RosField& field, const std::string& name, int depth, RosWire* wire,
                   RosNode* node, std::vector<std::string>* names) {
    if (field.kind == RosKind::kMessage && names->size() < kMaxLeaves) {
      DescribeMessage(field.message, name + ".", depth + 1, wire, node, names);
      return;
    }
    SkipElements(field, 1, depth, wire);
    const bool is_number = field.kind == RosKind::kNumber || field.kind == RosKind::kTime;
    if (!is_number || names->size() >= kMaxLeaves) return;
    node->leaves = 1;
    names->push_back(name);
    if (field.kind == RosKind::kTime) times_.insert({name, true});
  }

  // --- Any message. A null node: nothing of the value is wanted.
  void DecodeMessage(const std::string& type, RosWire* wire, const RosNode* node, RosOutput* output,
                     int depth) const {
    const std::vector<RosField>* fields = Fields(type, depth, wire);
    if (fields == nullptr || !wire->Visit(fields->size() + 1)) return;
    for (std::size_t i = 0; i < fields->size() && wire->ok(); ++i) {
      const RosNode* part = node != nullptr && i < node->parts.size() ? &node->parts[i] : nullptr;
      DecodeField((*fields)[i], wire, part, output, depth);
    }
    if (fields->empty() && cdr_) wire->SkipNumbers(Scalar::kU8, 1);
  }

  void DecodeField(const RosField& field, RosWire* wire, const RosNode* node, RosOutput* output,
                   int depth) const {
    if (!field.is_list) return DecodeOne(field, wire, node, output, depth);
    const std::uint64_t count = field.length ? *field.length : wire->Count();
    const std::size_t listed = node == nullptr ? 0 : node->parts.size();
    for (std::size_t i = 0; i < listed; ++i) {
      if (i < count && wire->ok()) {
        DecodeOne(field, wire, &node->parts[i], output, depth);
      } else {
        output->next += node->parts[i].leaves;
      }
    }
    if (count > listed) SkipElements(field, count - listed, depth, wire);
  }

  void DecodeOne(const RosField& field, RosWire* wire, const RosNode* node, RosOutput* output,
                 int depth) const {
    if (node == nullptr || node->leaves == 0) return SkipElements(field, 1, depth, wire);
    if (field.kind == RosKind::kMessage) {
      DecodeMessage(field.message, wire, node, output, depth + 1);
    } else {
      output->Put(field.kind == RosKind::kTime ? wire->Time() : wire->Number(field.scalar));
    }
  }

  void SkipElements(const RosField& field, std::uint64_t count, int depth, RosWire* wire) const {
    if (field.kind == RosKind::kNumber) return wire->SkipNumbers(field.scalar, count);
    RosOutput none;
    for (std::uint64_t i = 0; i < count && wire->ok(); ++i) {
      if (field.kind == RosKind::kMessage) {
        const std::size_t before = wire->left();
        DecodeMessage(field.message, wire, nullptr, &none, depth + 1);
        if (wire->left() == before) return;  // a message without bytes, any number of times
      } else if (field.kind == RosKind::kTime) {
        wire->Time();
      } else {
        wire->SkipText(field.kind == RosKind::kWideText ? 2 : 1);
      }
    }
  }

  std::string type_;
  bool cdr_;
  RosTypes types_;
  RosNode root_;
  std::size_t nodes_ = 0;                           // below the root
  bool may_grow_ = false;                           // the type has lists of any length
  mutable bool too_many_ = false;                   // parts: no message is visited again
  std::map<std::string, bool, std::less<>> times_;  // names of fields that are times
};

}  // namespace

std::unique_ptr<MessageDecoder> MakeRos1Decoder(const std::string& type,
                                                const std::string& definition) {
  return std::make_unique<RosDecoder>(type, definition, false);
}

std::unique_ptr<MessageDecoder> MakeCdrDecoder(const std::string& type,
                                               const std::string& definition) {
  return std::make_unique<RosDecoder>(type, definition, true);
}

}  // namespace trueline
