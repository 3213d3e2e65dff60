#include "problems/log/unpacked.h"

#include <unistd.h>

#include <array>
#include <charconv>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "problems/common/error.h"
#include "problems/log/decompress.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPiece = 1 << 18;  // bytes
constexpr int kMostLayers = 4;           // as a tar in a zip

struct Packing {
  const char* name;
  const char* ending;
  std::string_view magic;
  Decoder (*decoder)();
};
constexpr std::array<Packing, 4> kPackings = {{
    {"gzip", ".gz", "\x1f\x8b", [] { return Inflater(31); }},
    {"bzip2", ".bz2", "BZh", [] { return Bunzipper(); }},
    {"xz", ".xz",
     std::string_view("\xFD"
                      "7zXZ\0",
                      6),
     [] { return Unxzipper(); }},
    {"zstd", ".zst", "\x28\xB5\x2F\xFD", [] { return Unzstder(); }},
}};

// Unpacks files for as long as the program runs.
class Unpacker {
 public:
  Unpacker() = default;
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;
  ~Unpacker() {
    std::error_code unknown;
    if (!folder_.empty()) fs::remove_all(folder_, unknown);
  }

  fs::path Of(const fs::path& path) {
    std::error_code unknown;
    if (!fs::is_regular_file(path, unknown)) return path;
    const auto key = std::pair(fs::absolute(path), fs::last_write_time(path, unknown));
    const auto known = known_.find(key);
    if (known != known_.end()) return known->second;
    user_path_ = path;
    fs::path content = path;
    for (int layer = 0; layer < kMostLayers; ++layer) {
      const fs::path inner = WithoutLayer(content);
      if (inner == content) break;
      content = inner;
    }
    return known_[key] = content;
  }

  fs::path NewFile(const fs::path& path) {
    user_path_ = path;
    return NewFolder() / path.filename();
  }

 private:
  // The content of the outermost packing; `path` itself where there is none.
  fs::path WithoutLayer(const fs::path& path) {
    if (!fs::is_regular_file(path)) return path;
    std::ifstream in(path, std::ios::binary);
    std::string start(512, '\0');
    in.read(start.data(), 512);
    start.resize(static_cast<std::size_t>(in.gcount()));
    for (const Packing& packing : kPackings) {
      if (!start.starts_with(packing.magic)) continue;
      fs::path name = path.filename();
      if (name.extension() == ".tgz") name.replace_extension(".tar");
      if (name.extension() == packing.ending || name.extension() == ".zstd") name = name.stem();
      const fs::path to = NewFolder() / name;
      in.clear();
      in.seekg(0);
      Decode(packing.decoder(), fs::file_size(path), packing.name, &in, to);
      return to;
    }
    if (start.starts_with("PK\x03\x04")) return FromZip(path);
    if (start.size() == 512 && start.substr(257, 5) == "ustar") return FromTar(path);
    return path;
  }

  [[noreturn]] void Damaged(const std::string& what) const {
    throw ErrorAt(user_path_.string(), 0,
                  "is damaged or cut off (" + what + "); copy it again, or unpack it yourself");
  }

  fs::path NewFolder() {
    if (folder_.empty()) {
      std::string name = (fs::temp_directory_path() / "trueline-XXXXXX").string();
      if (mkdtemp(name.data()) == nullptr) {
        throw ErrorAt(user_path_.string(), 0,
                      "cannot be unpacked to the folder for temporary files; make room there, or "
                      "name another one by TMPDIR");
      }
      folder_ = name;
    }
    const fs::path folder = folder_ / std::to_string(count_++);
    fs::create_directories(folder);
    return folder;
  }

  // `size` bytes of `in` from where it stands.
  void Decode(const Decoder& decode, std::uint64_t size, const char* what, std::ifstream* in,
              const fs::path& to) const {
    std::ofstream out(to, std::ios::binary);
    std::string piece(kPiece, '\0'), buffer;
    DecodeStep step;
    bool written = decode != nullptr;
    while (written) {
      if (buffer.size() < kPiece && size > 0) {
        const std::size_t before = buffer.size();
        const auto want = static_cast<std::size_t>(std::min<std::uint64_t>(kPiece, size));
        buffer.resize(before + want);
        in->read(buffer.data() + before, static_cast<std::streamsize>(want));
        buffer.resize(before + static_cast<std::size_t>(in->gcount()));
        size = in->gcount() == static_cast<std::streamsize>(want) ? size - want : 0;
      }
      step = decode(buffer.data(), buffer.size(), piece.data(), kPiece, size == 0);
      if (!step.good) Damaged(what);
      out.write(piece.data(), static_cast<std::streamsize>(step.wrote));
      buffer.erase(0, step.read);
      if (step.read == 0 && step.wrote == 0) break;
      if (step.ended && buffer.empty() && size == 0) break;
      written = out.good();
    }
    if (!out.flush() || !written) {
      throw ErrorAt(user_path_.string(), 0,
                    "cannot be unpacked: no room in the folder for temporary files; name another "
                    "one by TMPDIR");
    }
    // Bytes that fill up a last block may follow the content.
    if (!step.ended && !(step.read == 0 && !buffer.empty())) Damaged(what);
  }

  static std::uint64_t Little(std::string_view bytes, std::size_t at, std::size_t count) {
    std::uint64_t value = 0;
    for (std::size_t i = count; i-- > 0;) {
      value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    }
    return value;
  }

  // Names as an archive has them never lead out of the folder.
  static fs::path Inside(const fs::path& folder, const std::string& name) {
    fs::path inside = folder;
    for (const fs::path& part : fs::path(name).relative_path()) {
      if (part != ".." && part != ".") inside /= part;
    }
    fs::create_directories(inside.parent_path());
    return inside;
  }

  // A single file, else the folder.
  static fs::path ContentOf(fs::path folder) {
    for (;;) {
      std::vector<fs::path> entries;
      for (const auto& entry : fs::directory_iterator(folder)) entries.push_back(entry.path());
      if (entries.size() != 1) return folder;
      folder = entries.front();
      if (!fs::is_directory(folder)) return folder;
    }
  }

  fs::path FromZip(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    const std::uint64_t size = fs::file_size(path);
    const auto read = [&](std::uint64_t at, std::uint64_t count) {
      std::string bytes(static_cast<std::size_t>(at + count > size ? 0 : count), '\0');
      in.clear();
      in.seekg(static_cast<std::streamoff>(at));
      in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      if (bytes.size() != count || !in) Damaged("zip");
      return bytes;
    };
    const std::uint64_t tail = std::min<std::uint64_t>(size, 22 + 65535);
    const std::string end = read(size - tail, tail);
    const std::size_t found = end.rfind("PK\x05\x06");
    if (found == std::string::npos || end.size() < found + 22) Damaged("zip");
    std::uint64_t at = Little(end, found + 16, 4);
    const fs::path folder = NewFolder();
    for (std::uint64_t i = Little(end, found + 10, 2); i > 0; --i) {
      const std::string head = read(at, 46);
      if (!head.starts_with("PK\x01\x02")) Damaged("zip");
      const std::string name = read(at + 46, Little(head, 28, 2));
      const std::uint64_t packed = Little(head, 20, 4), method = Little(head, 10, 2);
      const std::uint64_t local = Little(head, 42, 4);
      at += 46 + Little(head, 28, 2) + Little(head, 30, 2) + Little(head, 32, 2);
      if (name.ends_with('/')) continue;
      const bool is_large = packed == 0xFFFFFFFF || local == 0xFFFFFFFF;
      if (is_large || (method != 0 && method != 8) || Little(head, 8, 2) % 2 != 0) {
        throw ErrorAt(user_path_.string(), 0,
                      "is a zip archive with a password or of a kind that is not read here; unpack "
                      "it first: unzip " +
                          user_path_.filename().string());
      }
      const std::string own = read(local, 30);
      in.seekg(static_cast<std::streamoff>(local + 30 + Little(own, 26, 2) + Little(own, 28, 2)));
      Decode(method == 0 ? Copier() : Inflater(-15), packed, "zip", &in, Inside(folder, name));
    }
    return ContentOf(folder);
  }

  fs::path FromTar(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    const fs::path folder = NewFolder();
    std::string block(512, '\0'), long_name;
    while (in.read(block.data(), 512) && block[0] != '\0') {
      const auto text = [&](std::size_t from, std::size_t count) {
        const std::string field = block.substr(from, count);
        return field.substr(0, field.find('\0'));
      };
      std::uint64_t size = 0;
      const std::string octal = text(124, 12);
      const std::size_t digit = std::min(octal.find_first_not_of(' '), octal.size());
      std::from_chars(octal.data() + digit, octal.data() + octal.size(), size, 8);
      std::string name = text(0, 100);
      const std::string prefix =
          block.substr(257, 6) == std::string("ustar\0", 6) ? text(345, 155) : "";
      if (!prefix.empty()) name = prefix + "/" + name;
      if (!long_name.empty()) name = std::exchange(long_name, "");
      const char type = block[156];
      const auto start = in.tellg();
      if (type == 'L' || type == 'x') {
        std::string content(static_cast<std::size_t>(std::min<std::uint64_t>(size, 1 << 16)), '\0');
        in.read(content.data(), static_cast<std::streamsize>(content.size()));
        const std::size_t key = type == 'x' ? content.find("path=") : 0;
        if (key != std::string::npos) {
          long_name = content.substr(type == 'x' ? key + 5 : 0);
          long_name.resize(std::min(long_name.find(type == 'x' ? '\n' : '\0'), long_name.size()));
        }
      } else if (type == '0' || type == '\0' || type == '7') {
        Decode(Copier(), size, "tar", &in, Inside(folder, name));
        if (fs::file_size(Inside(folder, name)) != size) Damaged("tar");
      }
      in.clear();
      in.seekg(start + static_cast<std::streamoff>((size + 511) / 512 * 512));
    }
    return ContentOf(folder);
  }

  fs::path folder_, user_path_;
  int count_ = 0;
  std::map<std::pair<fs::path, fs::file_time_type>, fs::path> known_;
};

Unpacker& TheUnpacker() {
  static Unpacker unpacker;
  return unpacker;
}

}  // namespace

fs::path Unpacked(const fs::path& path) { return TheUnpacker().Of(path); }

fs::path TemporaryFor(const fs::path& path) { return TheUnpacker().NewFile(path); }

}  // namespace trueline
