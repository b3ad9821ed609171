#include "scene/obj_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <vector>

#include "halfshade/halfshade.hpp"
#include "scene/limits.hpp"
#include "scene/printable.hpp"

namespace halfshade {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}
bool is_line_end(char c) {
  return c == '\n' || c == '\r';
}

/// Takes the next word off the front of `rest`; empty at the end.
std::string_view next_word(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && is_blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

std::string shown(std::string_view word) {
  return word.empty() ? "the end of the line" : fmt::format("\"{}\"", printable(word));
}

bool is_finite_number(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  const char* const word_end = word.data() + word.size();
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word_end, value);
  if (error == std::errc::result_out_of_range) {
    // Too large, or too small to tell from 0, which is fine.
    long double wide = 1.0L;
    return std::from_chars(word.data(), word_end, wide).ptr == word_end && std::abs(wide) < 1.0L;
  }
  return error == std::errc{} && end == word_end && std::isfinite(value);
}

/// Takes a whole number off the front of `text`. Nothing, and all left as it is, where there is none that fits into 32 bits.
std::optional<std::int32_t> take_index(std::string_view& text) {
  std::int32_t index = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
  if (error != std::errc{}) return {};
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return index;
}

bool take_slash(std::string_view& text) {
  if (!text.starts_with('/')) return false;
  text.remove_prefix(1);
  return true;
}

/// The vertex index of a face's corner: `7`, `7/1`, `7//3` or `7/1/3`. 0, which OBJ does not use, for anything else.
std::int32_t vertex_index_of(std::string_view corner) {
  const std::int32_t vertex = take_index(corner).value_or(0);
  if (take_slash(corner)) {
    const bool has_texture = take_index(corner).has_value();
    const bool has_normal = take_slash(corner);
    if (has_normal ? !take_index(corner) : !has_texture) return 0;
  }
  return corner.empty() ? vertex : 0;
}

/// The lines of a text, one after the other. A line that ends in a backslash is one with the next.
class Lines {
 public:
  explicit Lines(std::string& text) : text_(text) {}

  /// The next line, with continuations blanked; nothing at the end.
  std::optional<std::string_view> next() {
    if (begin_ >= text_.size()) return {};
    first_line_ = ++last_line_;
    continued_.clear();
    std::size_t end = begin_;
    while (blank_continuation(end = line_end(end))) ++last_line_;
    const std::string_view line = std::string_view(text_).substr(begin_, end - begin_);
    begin_ = end + line_end_size(end);
    return line;
  }

  /// Removes a comment from the end of the line that `next` returned last.
  std::string_view without_comment(std::string_view line) {
    const std::size_t comment = line.find('#');
    if (comment == line.npos) return line;
    const auto begin = text_.begin() + (line.data() + comment - text_.data());
    std::fill(begin, begin + static_cast<std::ptrdiff_t>(line.size() - comment), ' ');
    return line.substr(0, comment);
  }

  /// The line of the file in which a part of the last line stands.
  std::size_t number_of(std::string_view part) const {
    const auto offset = static_cast<std::size_t>(part.data() - text_.data());
    return first_line_ + static_cast<std::size_t>(std::ranges::upper_bound(continued_, offset) - continued_.begin());
  }

 private:
  std::size_t line_end(std::size_t at) const {
    while (at < text_.size() && !is_line_end(text_[at])) ++at;
    return at;
  }
  std::size_t line_end_size(std::size_t end) const { return std::string_view(text_).substr(end, 2) == "\r\n" ? 2 : 1; }

  /// Blanks a backslash before the line end at `end` and that itself, where the line is continued; comments are not.
  bool blank_continuation(std::size_t end) {
    const std::size_t begin = continued_.empty() ? begin_ : continued_.back();
    std::size_t last = end;
    while (last > begin && is_blank(text_[last - 1])) --last;
    if (last == begin || text_[last - 1] != '\\') return false;
    if (std::string_view(text_).substr(begin, last - begin).find('#') != std::string_view::npos) return false;
    const std::size_t next = std::min(end + line_end_size(end), text_.size());
    std::fill(text_.begin() + static_cast<std::ptrdiff_t>(last - 1), text_.begin() + static_cast<std::ptrdiff_t>(next), ' ');
    continued_.push_back(next);
    return true;
  }

  std::string& text_;
  std::size_t begin_ = 0, first_line_ = 0, last_line_ = 0;
  std::vector<std::size_t> continued_;  // where the second and later lines of the last one begin
};

class ObjChecker {
 public:
  ObjChecker(std::string& text, const std::string& file) : file_(file), lines_(text) {}

  void check() {
    while (const std::optional<std::string_view> line = lines_.next()) {
      std::string_view rest = *line;
      const std::string_view keyword = next_word(rest);
      if (keyword == "v") vertex(lines_.without_comment(rest));
      if (keyword == "f") face(lines_.without_comment(rest));
    }
    if (greatest_index_ > vertex_count_)
      fail_at(greatest_index_line_, fmt::format("a vertex index no higher than {}, the vertices in the file", vertex_count_),
              fmt::format("{}", greatest_index_));
    if (corner_count_ == 0)
      throw InputError(
          fmt::format("{}: expected faces (found {} vertices and no f line); is it an OBJ file?", file_, vertex_count_));
  }

 private:
  [[noreturn]] void fail_at(std::size_t line, std::string_view expected, std::string_view found) const {
    throw InputError(fmt::format("{}: line {}: expected {} (found {})", file_, line, expected, found));
  }
  [[noreturn]] void fail(std::string_view part, std::string_view expected, std::string_view found) const {
    fail_at(lines_.number_of(part), expected, found);
  }

  void vertex(std::string_view rest) {
    for (int i = 0; i < 3; ++i) {
      const std::string_view word = next_word(rest);
      if (!is_finite_number(word)) fail(word, "three finite numbers after v", shown(word));
    }
    if (static_cast<std::size_t>(++vertex_count_) > limits::obj_vertices)
      fail(rest, fmt::format("at most {} vertices", limits::obj_vertices), "another; split the mesh");
  }

  void face(std::string_view rest) {
    std::size_t count = 0;
    for (std::string_view word; !(word = next_word(rest)).empty(); ++count) {
      const std::int64_t index = vertex_index_of(word);
      if (index == 0) fail(word, "corners as 7, 7/1, 7//3 or 7/1/3 after f, counted from 1 (or from -1 backwards)", shown(word));
      if (index < -vertex_count_)
        fail(word, fmt::format("a relative index no lower than -{}, the vertices so far", vertex_count_), shown(word));
      if (index > greatest_index_) {
        greatest_index_ = index;
        greatest_index_line_ = lines_.number_of(word);
      }
    }
    if (count < 3) fail(rest, "at least three vertices after f", fmt::format("{}", count));
    corner_count_ += count;
    if (corner_count_ > limits::obj_corners)
      fail(rest, fmt::format("at most {} corners of faces", limits::obj_corners), "more; split the mesh");
  }

  const std::string& file_;
  Lines lines_;
  std::int64_t vertex_count_ = 0;
  std::size_t corner_count_ = 0;
  // Faces may come before their vertices, so the greatest index can only be judged at the end.
  std::int64_t greatest_index_ = 0;
  std::size_t greatest_index_line_ = 0;
};

}  // namespace

void check_obj_text(std::string& text, const std::string& file) {
  if (text.empty()) throw InputError(fmt::format("{}: expected an OBJ file (found an empty file)", file));
  if (text.find('\0') != text.npos)
    throw InputError(fmt::format("{}: expected an OBJ file, which is text (found binary data); convert it to OBJ", file));
  if (text.starts_with("\xef\xbb\xbf")) text.replace(0, 3, "   ");
  ObjChecker(text, file).check();
}

std::optional<std::size_t> line_of_vertex(const std::string& text, std::size_t vertex) {
  std::string copy = text;
  Lines lines(copy);
  while (std::optional<std::string_view> line = lines.next()) {
    const std::string_view word = next_word(*line);
    if ((word == "v" || word == "\xef\xbb\xbfv") && vertex-- == 0) return lines.number_of(word);
  }
  return {};
}

}  // namespace halfshade
