#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>

#include <set>

#include "problems/import/formats/recording.h"
#include "problems/import/formats/ros_decoder.h"

namespace trueline {
namespace {

namespace pb = google::protobuf;

// Errors of a definition make its channel undescribed; protobuf would print them.
class SilentErrors : public pb::DescriptorPool::ErrorCollector {
 public:
  void AddError(const std::string&, const std::string&, const pb::Message*, ErrorLocation,
                const std::string&) override {}
};

// google.protobuf.Timestamp and Duration, by the names of their fields.
bool ProtobufTime(const pb::Message& message, Cell* time) {
  const pb::Descriptor* type = message.GetDescriptor();
  const bool known = type->full_name() == "google.protobuf.Timestamp" ||
                     type->full_name() == "google.protobuf.Duration";
  const pb::FieldDescriptor* seconds = known ? type->FindFieldByName("seconds") : nullptr;
  const pb::FieldDescriptor* nanos = known ? type->FindFieldByName("nanos") : nullptr;
  if (seconds == nullptr || nanos == nullptr || seconds->is_repeated() || nanos->is_repeated() ||
      seconds->cpp_type() != pb::FieldDescriptor::CPPTYPE_INT64 ||
      nanos->cpp_type() != pb::FieldDescriptor::CPPTYPE_INT32) {
    return false;
  }
  TimeNs whole = 0;
  if (!Cell(message.GetReflection()->GetInt64(message, seconds)).Time(9, &whole)) return false;
  const std::int64_t rest = message.GetReflection()->GetInt32(message, nanos);
  if (__builtin_add_overflow(whole, rest, &whole)) return false;
  *time = Cell(whole);
  return true;
}

class ProtobufFlattener {
 public:
  explicit ProtobufFlattener(std::vector<NamedCell>* row) : row_(row) {}

  // Whether the message had too many parts to visit them all.
  bool too_many() const { return parts_ > kMaxNamedParts; }

  void Add(const pb::Message& message, const std::string& prefix, int depth) {
    if (depth > kMaxNamedDepth) return;
    const pb::Descriptor* type = message.GetDescriptor();
    for (int i = 0; i < type->field_count() && !too_many(); ++i) {
      const pb::FieldDescriptor* field = type->field(i);
      const std::string name = prefix + field->name();
      if (!field->is_repeated()) {
        AddOne(message, field, -1, name, depth);
        continue;
      }
      const int count = std::min(message.GetReflection()->FieldSize(message, field),
                                 static_cast<int>(kMaxNamedElements));
      for (int k = 0; k < count; ++k) {
        AddOne(message, field, k, fmt::format("{}[{}]", name, k), depth);
      }
    }
  }

 private:
  // `k` is the place in a repeated field, or negative.
  void AddOne(const pb::Message& message, const pb::FieldDescriptor* field, int k,
              const std::string& name, int depth) {
    if (++parts_ > kMaxNamedParts || row_->size() >= kMaxNamedCells) return;
    const pb::Reflection* of = message.GetReflection();
    using Type = pb::FieldDescriptor;
    const auto get = [&](auto one, auto of_list) {
      return k < 0 ? (of->*one)(message, field) : (of->*of_list)(message, field, k);
    };
    switch (field->cpp_type()) {
      case Type::CPPTYPE_MESSAGE: {
        if (k < 0 && !of->HasField(message, field) && depth > 4) return;  // a type may hold itself
        const pb::Message& part =
            k < 0 ? of->GetMessage(message, field) : of->GetRepeatedMessage(message, field, k);
        Cell time;
        if (!ProtobufTime(part, &time)) return Add(part, name + ".", depth + 1);
        row_->push_back({name, time, true});
        return;
      }
      case Type::CPPTYPE_DOUBLE:
        return Put(name, Cell(get(&pb::Reflection::GetDouble, &pb::Reflection::GetRepeatedDouble)));
      case Type::CPPTYPE_FLOAT:
        return Put(name,
                   Cell(double{get(&pb::Reflection::GetFloat, &pb::Reflection::GetRepeatedFloat)}));
      case Type::CPPTYPE_INT32:
        return PutWhole(name, get(&pb::Reflection::GetInt32, &pb::Reflection::GetRepeatedInt32));
      case Type::CPPTYPE_UINT32:
        return PutWhole(name, get(&pb::Reflection::GetUInt32, &pb::Reflection::GetRepeatedUInt32));
      case Type::CPPTYPE_INT64:
        return PutWhole(name, get(&pb::Reflection::GetInt64, &pb::Reflection::GetRepeatedInt64));
      case Type::CPPTYPE_UINT64:
        return PutWhole(name, get(&pb::Reflection::GetUInt64, &pb::Reflection::GetRepeatedUInt64));
      case Type::CPPTYPE_BOOL:
        return PutWhole(name, get(&pb::Reflection::GetBool, &pb::Reflection::GetRepeatedBool));
      case Type::CPPTYPE_ENUM:
        return PutWhole(name,
                        get(&pb::Reflection::GetEnumValue, &pb::Reflection::GetRepeatedEnumValue));
      case Type::CPPTYPE_STRING:
        return;
    }
  }

  void Put(const std::string& name, const Cell& cell) { row_->push_back({name, cell}); }
  template <class Whole>
  void PutWhole(const std::string& name, Whole value) {
    Put(name, Cell(static_cast<std::int64_t>(value)));
  }

  std::vector<NamedCell>* row_;
  std::size_t parts_ = 0;
};

class ProtobufDecoder final : public NamedRowDecoder {
 public:
  ProtobufDecoder(const std::string& type, const std::string& descriptors) {
    pb::FileDescriptorSet set;
    if (!set.ParseFromString(descriptors)) return;
    // A file must come after those that it imports; the set may have any order.
    for (bool any = true; any && pool_.FindMessageTypeByName(type) == nullptr;) {
      any = false;
      for (const pb::FileDescriptorProto& file : set.file()) any |= Build(file);
    }
    type_ = pool_.FindMessageTypeByName(type);
  }

  std::string Refusal() const override {
    if (!too_many_) return "";
    return fmt::format("a message has more than {} parts, counting those of unset messages",
                       kMaxNamedParts);
  }

 private:
  bool Build(const pb::FileDescriptorProto& file) {
    if (tried_.contains(file.name())) return false;
    for (const std::string& import : file.dependency()) {
      if (pool_.FindFileByName(import) == nullptr) return false;
    }
    tried_.insert(file.name());
    SilentErrors errors;
    return pool_.BuildFileCollectingErrors(file, &errors) != nullptr;
  }

  bool Parse(std::string_view bytes, std::vector<NamedCell>* row) const override {
    constexpr std::size_t kMost = 1 << 30;
    if (type_ == nullptr || too_many_ || bytes.size() > kMost) return false;
    const std::unique_ptr<pb::Message> message(factory_.GetPrototype(type_)->New());
    if (!message->ParsePartialFromArray(bytes.data(), static_cast<int>(bytes.size()))) return false;
    ProtobufFlattener flattener(row);
    flattener.Add(*message, "", 0);
    too_many_ = flattener.too_many();
    return !too_many_;
  }

  pb::DescriptorPool pool_;
  std::set<std::string> tried_;
  mutable pb::DynamicMessageFactory factory_;
  const pb::Descriptor* type_ = nullptr;
  mutable bool too_many_ = false;  // the type's messages cost too much: none is visited again
};

}  // namespace

std::unique_ptr<MessageDecoder> MakeProtobufDecoder(const std::string& type,
                                                    const std::string& descriptors) {
  return std::make_unique<ProtobufDecoder>(type, descriptors);
}

}  // namespace trueline
