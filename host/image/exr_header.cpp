// "OpenEXR File Layout", Academy Software Foundation: magic number, version and flags, then for each part its attributes (name,
// type, size, value) up to an empty name, and in files of several parts another empty name. All numbers are little-endian.
#include "image/exr_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string_view>

#include "halfshade/halfshade.hpp"
#include "scene/limits.hpp"
#include "scene/printable.hpp"

namespace halfshade {
namespace {

/// Bytes that are taken off the front, as far as there are any.
class Bytes {
 public:
  explicit Bytes(std::string_view bytes) : bytes_(bytes) {}

  std::optional<std::string_view> take(std::size_t count) {
    if (count > bytes_.size()) return {};
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }
  std::optional<std::uint32_t> take_number() {
    const auto taken = take(4);
    if (!taken) return {};
    std::uint32_t number = 0;
    for (int i = 3; i >= 0; --i) number = number << 8 | static_cast<unsigned char>((*taken)[static_cast<std::size_t>(i)]);
    return number;
  }
  std::optional<std::string_view> take_text() {
    const std::size_t end = bytes_.find('\0');
    if (end == bytes_.npos) return {};
    const auto text = take(end);
    take(1);
    return text;
  }
  std::optional<unsigned char> take_byte() {
    const auto taken = take(1);
    if (!taken) return {};
    return static_cast<unsigned char>(taken->front());
  }

 private:
  std::string_view bytes_;
};

/// What a part's header says of it.
struct Part {
  std::optional<ExrHeader> picture;  ///< once its size is known
  std::vector<std::string> channels;
  std::uint64_t pixel_bytes = 0;  ///< of all channels
  std::uint64_t rows_at_once = 1;
  std::uint64_t declared_chunks = 0;
  std::optional<glm::u64vec2> tile;
  unsigned levels = 0;  ///< of tiles: one, mipmap or ripmap
};

/// Rows that are packed together, by number of the compression: none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab.
constexpr std::uint64_t rows_by_compression[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

bool read_channels(Bytes value, Part& part) {
  constexpr std::uint64_t bytes_of_type[] = {4, 2, 4};  // uint, half, float
  while (const auto name = value.take_text()) {
    if (name->empty()) return true;
    const auto type = value.take_number();
    if (!type || *type >= std::size(bytes_of_type) || !value.take(12)) return false;
    part.channels.emplace_back(*name);
    part.pixel_bytes += bytes_of_type[*type];
  }
  return false;
}

bool read_data_window(Bytes value, Part& part) {
  std::int64_t corners[4];
  for (std::int64_t& corner : corners) {
    const auto number = value.take_number();
    if (!number) return false;
    corner = static_cast<std::int32_t>(*number);
  }
  const std::int64_t width = corners[2] - corners[0] + 1, height = corners[3] - corners[1] + 1;
  if (width < 1 || height < 1 || width > UINT32_MAX || height > UINT32_MAX) return false;
  part.picture = ExrHeader{{width, height}, {}};
  return true;
}

bool read_tiles(Bytes value, Part& part) {
  const auto width = value.take_number(), height = value.take_number();
  const auto mode = value.take_byte();
  if (!width || !height || !mode || *width < 1 || *height < 1) return false;
  part.tile = glm::u64vec2(*width, *height);
  part.levels = *mode & 15;
  return part.levels <= 2;
}

/// Reads what counts; other attributes are passed over. Returns whether it could be read.
bool read_attribute(std::string_view name, Bytes value, Part& part) {
  if (name == "channels") return read_channels(value, part);
  if (name == "dataWindow") return read_data_window(value, part);
  if (name == "tiles") return read_tiles(value, part);
  if (name == "chunkCount") {
    const auto count = value.take_number();
    part.declared_chunks = count.value_or(0);
    return count.has_value();
  }
  if (name == "compression") {
    const auto number = value.take_byte();
    if (!number || *number >= std::size(rows_by_compression)) return false;
    part.rows_at_once = rows_by_compression[*number];
  }
  return true;
}

/// Tiles along one side, of all levels where there are several.
std::uint64_t tiles_along(std::uint64_t side, std::uint64_t tile, bool all_levels) {
  std::uint64_t count = 0;
  for (;; side = (side + 1) / 2) {
    count += (side + tile - 1) / tile;
    if (!all_levels || side <= 1) return count;
  }
}

/// At least as many as there are pieces that a part's pixels are packed in.
std::uint64_t chunk_count(const Part& part) {
  const glm::u64vec2 size(part.picture->resolution);
  if (!part.tile) return std::max(part.declared_chunks, (size.y + part.rows_at_once - 1) / part.rows_at_once);
  const bool ripmap = part.levels == 2;
  const std::uint64_t tiles = tiles_along(size.x, part.tile->x, ripmap) * tiles_along(size.y, part.tile->y, ripmap);
  return std::max(part.declared_chunks, tiles);
}

class HeaderReader {
 public:
  HeaderReader(std::string file, std::string_view bytes, std::uint64_t file_bytes)
      : file_(std::move(file)), bytes_(bytes), file_bytes_(file_bytes) {}

  ExrHeader read() {
    constexpr std::uint32_t magic = 20000630, deep = 0x800, several_parts = 0x1000;
    if (bytes_.take_number() != magic) fail("a whole EXR picture", "no EXR file");
    const std::uint32_t version = bytes_.take_number().value_or(0);
    if ((version & 255) != 2 || (version & deep) != 0) fail("a flat EXR picture", "another kind of EXR file");
    std::optional<ExrHeader> first;
    std::uint64_t chunks = 0;
    while (const std::optional<Part> part = read_part()) {
      chunks += check(*part);
      if (!first) first = ExrHeader{part->picture->resolution, part->channels};
      if ((version & several_parts) == 0) break;
    }
    if (!first) fail("a whole EXR picture", "no pixels");
    if (chunks * sizeof(std::uint64_t) > file_bytes_) fail("a whole EXR picture", "a part of the file");
    return *first;
  }

 private:
  [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
    throw InputError(fmt::format("{}: expected {} (found {})", file_, expected, found));
  }

  /// The next part; nothing where an empty name says that there is none.
  std::optional<Part> read_part() {
    Part part;
    for (bool is_first = true;; is_first = false) {
      const auto name = bytes_.take_text();
      if (name && name->empty()) {
        if (is_first) return {};
        return part;
      }
      const auto type = name ? bytes_.take_text() : std::nullopt;
      const auto size = type ? bytes_.take_number() : std::nullopt;
      const auto value = size ? bytes_.take(*size) : std::nullopt;
      if (!value) fail(fmt::format("a whole header of at most {} MiB", limits::exr_header_bytes >> 20), "none");
      if (!read_attribute(*name, Bytes(*value), part))
        fail("a whole EXR picture", fmt::format("a bad attribute '{}'", printable(*name)));
    }
  }

  /// Throws where a part is too large; returns the number of its chunks.
  std::uint64_t check(const Part& part) const {
    if (!part.picture || part.channels.empty()) fail("a whole EXR picture", "no pixels");
    const glm::uvec2 size = part.picture->resolution;
    if (size.x > limits::side_px || size.y > limits::side_px)
      fail(fmt::format("a picture of at most {0}x{0} pixels", limits::side_px), fmt::format("{}x{}", size.x, size.y));
    if (part.channels.size() > limits::exr_channels)
      fail(fmt::format("at most {} channels", limits::exr_channels), fmt::format("{}", part.channels.size()));
    const glm::u64vec2 chunk = part.tile ? *part.tile : glm::u64vec2(size.x, part.rows_at_once);
    if (chunk.x > limits::side_px || chunk.y > limits::side_px || chunk.x * chunk.y * part.pixel_bytes > limits::exr_chunk_bytes)
      fail(fmt::format("rows or tiles that are packed together of at most {} MiB", limits::exr_chunk_bytes >> 20),
           fmt::format("{}x{} pixels of {} bytes", chunk.x, chunk.y, part.pixel_bytes));
    return chunk_count(part);
  }

  std::string file_;
  Bytes bytes_;
  std::uint64_t file_bytes_;
};

}  // namespace

ExrHeader read_exr_header(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::error_code error;
  const std::uintmax_t file_bytes = std::filesystem::file_size(path, error);
  if (!stream || error)
    throw InputError(fmt::format("{}: expected a whole EXR picture (cannot be read); check its permissions", path.string()));
  std::string bytes(std::min<std::uintmax_t>(file_bytes, limits::exr_header_bytes), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return HeaderReader(path.string(), bytes, file_bytes).read();
}

}  // namespace halfshade
