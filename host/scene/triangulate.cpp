// Ear clipping after Meisters 1975, "Polygons have ears". A corner can be cut off where it is a left turn and no other corner
// lies in its triangle. Each corner that is no ear remembers one point that keeps it from being one, and is looked at again only
// when that point has gone or its own neighbours have changed; points are found in a tree of boxes.
#include "scene/triangulate.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>

#include "scene/limits.hpp"

namespace halfshade {
namespace {

constexpr std::uint32_t none = UINT32_MAX;

/// Twice the signed area: positive where c lies left of a -> b.
double turn(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Distinct points, some of which have been removed, in a tree of boxes.
class PointTree {
 public:
  void build(std::span<const glm::dvec2> points) {
    points_ = points;
    order_.resize(points.size());
    std::iota(order_.begin(), order_.end(), 0u);
    leaf_of_.resize(points.size());
    is_there_.assign(points.size(), true);
    nodes_.clear();
    steps_ = 0;
    add_node(0, static_cast<std::uint32_t>(points.size()), none);
  }

  void remove(std::uint32_t point) {
    is_there_[point] = false;
    for (std::uint32_t i = leaf_of_[point]; i != none; i = nodes_[i].parent) {
      --nodes_[i].count;
      fit(nodes_[i]);
    }
  }

  /// A point in the closed triangle a, b, c, a left turn, that is none of its corners; none where there is no such point.
  std::uint32_t find_in(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
    const glm::dvec2 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
    stack_.assign(1, 0);
    while (!stack_.empty()) {
      const Node& node = nodes_[stack_.back()];
      stack_.pop_back();
      ++steps_;
      if (node.count == 0 || glm::any(glm::greaterThan(node.low, high)) || glm::any(glm::lessThan(node.high, low))) continue;
      if (is_right_of(a, b, node) || is_right_of(b, c, node) || is_right_of(c, a, node)) continue;
      if (node.left == none) {
        for (const std::uint32_t i : points_of(node)) {
          const glm::dvec2 p = points_[i];
          if (!is_there_[i] || p == a || p == b || p == c) continue;
          if (turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0) return i;
        }
        continue;
      }
      // By chance, so that no order of cutting makes each point found the next to go: of k points in a corner's triangle about
      // log k are then ever found.
      random_ = random_ * 1664525u + 1013904223u;
      const std::uint32_t first = random_ >> 31;
      stack_.push_back(node.left + first);
      stack_.push_back(node.left + 1 - first);
    }
    return none;
  }

  /// Nodes looked at since `build`.
  std::size_t steps() const { return steps_; }

 private:
  struct Node {
    glm::dvec2 low, high;
    std::uint32_t begin, end, parent;
    std::uint32_t left;   ///< of two children that stand side by side; none in leaves
    std::uint32_t count;  ///< points that are still there
  };

  /// Whether all of a box lies right of a -> b. `turn` is monotonic in both coordinates, rounding included, so that this agrees
  /// with what it says of each point in the box.
  static bool is_right_of(glm::dvec2 a, glm::dvec2 b, const Node& box) {
    const glm::dvec2 leftmost(b.y - a.y >= 0.0 ? box.low.x : box.high.x, b.x - a.x >= 0.0 ? box.high.y : box.low.y);
    return turn(a, b, leftmost) < 0.0;
  }

  /// Fits a box to the points in it that are still there.
  void fit(Node& node) const {
    node.low = glm::dvec2(std::numeric_limits<double>::infinity());
    node.high = -node.low;
    const auto extend = [&](glm::dvec2 low, glm::dvec2 high) {
      node.low = glm::min(node.low, low);
      node.high = glm::max(node.high, high);
    };
    if (node.left == none) {
      for (const std::uint32_t i : points_of(node))
        if (is_there_[i]) extend(points_[i], points_[i]);
    } else {
      for (const std::uint32_t child : {node.left, node.left + 1})
        if (nodes_[child].count > 0) extend(nodes_[child].low, nodes_[child].high);
    }
  }

  std::span<const std::uint32_t> points_of(const Node& node) const {
    return std::span(order_).subspan(node.begin, node.end - node.begin);
  }

  void add_node(std::uint32_t begin, std::uint32_t end, std::uint32_t parent) {
    nodes_.emplace_back();
    fill_node(static_cast<std::uint32_t>(nodes_.size() - 1), begin, end, parent);
  }

  void fill_node(std::uint32_t index, std::uint32_t begin, std::uint32_t end, std::uint32_t parent) {
    constexpr std::uint32_t leaf_size = 8;
    Node node{points_[order_[begin]], points_[order_[begin]], begin, end, parent, none, end - begin};
    for (std::uint32_t i = begin; i < end; ++i) {
      node.low = glm::min(node.low, points_[order_[i]]);
      node.high = glm::max(node.high, points_[order_[i]]);
    }
    if (end - begin <= leaf_size) {
      for (std::uint32_t i = begin; i < end; ++i) leaf_of_[order_[i]] = index;
      nodes_[index] = node;
      return;
    }
    const int axis = node.high.x - node.low.x >= node.high.y - node.low.y ? 0 : 1;
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t i, std::uint32_t j) { return points_[i][axis] < points_[j][axis]; });
    node.left = static_cast<std::uint32_t>(nodes_.size());
    nodes_[index] = node;
    nodes_.resize(nodes_.size() + 2);
    fill_node(node.left, begin, middle, index);
    fill_node(node.left + 1, middle, end, index);
  }

  std::span<const glm::dvec2> points_;
  std::vector<std::uint32_t> order_, leaf_of_, stack_;
  std::vector<bool> is_there_;
  std::vector<Node> nodes_;
  std::uint32_t random_ = 1;
  std::size_t steps_ = 0;
};

}  // namespace

/// A polygon whose ears are cut off, one by one, going round.
class Triangulator::EarCutter {
 public:
  /// As Triangulator::cut; `flat` are the corners in the plane.
  bool cut(std::span<const std::uint32_t> corners, std::span<const glm::dvec2> flat, std::vector<glm::uvec3>& triangles) {
    const std::size_t triangle_count = triangles.size(), max_steps = limits::ear_steps * flat.size();
    flat_ = flat;
    begin();
    std::uint32_t at = 0;
    for (std::size_t count = flat.size(); count >= 3; --count) {
      // Where nothing is an ear the polygon crosses itself or has no area: any corner will do.
      if (count > 3 && !ears_.empty()) {
        const auto next_ear = ears_.lower_bound(at);
        at = next_ear != ears_.end() ? *next_ear : *ears_.begin();
      }
      triangles.emplace_back(corners[before_[at]], corners[at], corners[after_[at]]);
      at = cut_off(at);
      if (tree_.steps() > max_steps) {
        triangles.resize(triangle_count);
        return false;
      }
    }
    return true;
  }

 private:
  /// Joins the corners to a ring, and finds the points at which they stand and the first ears.
  void begin() {
    const auto count = static_cast<std::uint32_t>(flat_.size());
    before_.resize(count);
    after_.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      before_[i] = (i + count - 1) % count;
      after_[i] = (i + 1) % count;
    }
    find_points(count);
    tree_.build(points_);
    if (waiting_.size() < points_.size()) waiting_.resize(points_.size());
    for (std::size_t i = 0; i < points_.size(); ++i) waiting_[i].clear();
    in_the_way_.assign(count, none);
    ears_.clear();
    for (std::uint32_t i = 0; i < count; ++i) examine(i);
  }

  /// Corners may stand at one point.
  void find_points(std::uint32_t count) {
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, {}, [&](std::uint32_t i) { return std::tuple(flat_[i].x, flat_[i].y, i); });
    points_.clear();
    corners_at_.clear();
    point_of_.resize(count);
    for (const std::uint32_t i : order) {
      if (points_.empty() || points_.back() != flat_[i]) {
        points_.push_back(flat_[i]);
        corners_at_.push_back(0);
      }
      point_of_[i] = static_cast<std::uint32_t>(points_.size() - 1);
      ++corners_at_.back();
    }
  }

  /// Decides whether a corner is an ear, and if not, what it waits for.
  void examine(std::uint32_t corner) {
    ears_.erase(corner);
    in_the_way_[corner] = none;
    const glm::dvec2 a = flat_[before_[corner]], b = flat_[corner], c = flat_[after_[corner]];
    if (!(turn(a, b, c) > 0.0)) return;
    const std::uint32_t found = tree_.find_in(a, b, c);
    if (found == none) {
      ears_.insert(corner);
    } else {
      in_the_way_[corner] = found;
      waiting_[found].push_back(corner);
    }
  }

  /// Removes a corner and returns the one after it.
  std::uint32_t cut_off(std::uint32_t corner) {
    const std::uint32_t a = before_[corner], c = after_[corner], point = point_of_[corner];
    after_[a] = c;
    before_[c] = a;
    ears_.erase(corner);
    in_the_way_[corner] = none;
    const bool was_last = --corners_at_[point] == 0;
    if (was_last) tree_.remove(point);
    examine(a);
    examine(c);
    if (was_last) {
      for (const std::uint32_t other : waiting_[point])
        if (in_the_way_[other] == point) examine(other);
    }
    return c;
  }

  std::span<const glm::dvec2> flat_;
  std::vector<std::uint32_t> before_, after_;        // the ring of corners that are left
  std::vector<glm::dvec2> points_;                   // where corners stand, each place once
  std::vector<std::uint32_t> point_of_;              // of a corner
  std::vector<std::uint32_t> corners_at_;            // of a point: how many are left
  std::vector<std::uint32_t> in_the_way_;            // of a corner: a point in its triangle
  std::vector<std::vector<std::uint32_t>> waiting_;  // of a point: corners that it is or was in the way of
  std::set<std::uint32_t> ears_;
  PointTree tree_;
};

Triangulator::Triangulator() : ears_(std::make_unique<EarCutter>()) {}
Triangulator::~Triangulator() = default;

bool Triangulator::cut(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions,
                       std::vector<glm::uvec3>& triangles) {
  if (corners.size() > 3) flatten(corners, positions);
  if (corners.size() > 3 && !is_strictly_convex()) return ears_->cut(corners, flat_, triangles);
  for (std::size_t i = 2; i < corners.size(); ++i) triangles.emplace_back(corners[0], corners[i - 1], corners[i]);
  return true;
}

/// Projects the corners along the axis that the polygon faces most, so that it runs counter-clockwise in `flat_`.
void Triangulator::flatten(std::span<const std::uint32_t> corners, std::span<const glm::dvec3> positions) {
  // Newell's normal, about the first corner for the sake of meshes far from the origin.
  const glm::dvec3 first = positions[corners[0]];
  glm::dvec3 normal(0.0);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    normal += glm::cross(positions[corners[i]] - first, positions[corners[i + 1]] - first);
  }
  const glm::dvec3 size = glm::abs(normal);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0.0) std::swap(u, v);
  flat_.clear();
  for (const std::uint32_t corner : corners) {
    const glm::dvec3 p = positions[corner] - first;
    flat_.emplace_back(p[u], p[v]);
  }
}

bool Triangulator::is_strictly_convex() const {
  const std::size_t count = flat_.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (!(turn(flat_[i], flat_[(i + 1) % count], flat_[(i + 2) % count]) > 0.0)) return false;
  }
  return true;
}

}  // namespace halfshade
