#include "sim3d/loaders/voxel_faces.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace stairwell::sim3d {

namespace {

constexpr std::uint64_t kMask = (1U << 21) - 1;
constexpr std::array<unsigned, 3> kShift{0, 21, 42};

std::int64_t coordinate(std::uint64_t key, std::size_t axis) {
  return static_cast<std::int64_t>(key >> kShift[axis] & kMask) - (1 << 20);
}

/// A rectangle of faces in the plane `plane` across `axis`; u and v are the two following axes.
struct Rectangle {
  std::int64_t plane;
  std::int64_t u_begin, u_end;
  std::int64_t v_begin, v_end;
};

/// Cells without a neighbour in the given direction. Both lists run in key order, so one pass over each is enough.
std::vector<std::uint64_t> exposed_cells(const std::vector<std::uint64_t>& keys, std::size_t axis, bool positive) {
  const std::uint64_t step = std::uint64_t{1} << kShift[axis];
  std::vector<std::uint64_t> exposed;
  std::size_t other = 0;
  for (const std::uint64_t key : keys) {
    const std::uint64_t neighbour = positive ? key + step : key - step;
    while (other < keys.size() && keys[other] < neighbour) {
      ++other;
    }
    if (other == keys.size() || keys[other] != neighbour) {
      exposed.push_back(key);
    }
  }
  return exposed;
}

/// Key order becomes plane, then u, then v.
std::uint64_t rotate_key(std::uint64_t key, std::size_t axis) {
  const std::uint64_t plane = key >> kShift[axis] & kMask;
  const std::uint64_t u = key >> kShift[(axis + 1) % 3] & kMask;
  const std::uint64_t v = key >> kShift[(axis + 2) % 3] & kMask;
  return plane << 42 | u << 21 | v;
}

/// Runs along v, joined over successive u where they have the same ends.
std::vector<Rectangle> merge_faces(std::vector<std::uint64_t> cells, std::size_t axis) {
  for (std::uint64_t& key : cells) {
    key = rotate_key(key, axis);
  }
  std::sort(cells.begin(), cells.end());
  std::vector<Rectangle> rectangles;
  std::vector<std::size_t> previous_row;  // rectangles that reach the row before, in v order
  std::vector<std::size_t> row;
  std::pair<std::int64_t, std::int64_t> row_id{-1, -1};
  std::size_t candidate = 0;
  for (std::size_t i = 0; i < cells.size();) {
    std::size_t j = i + 1;
    while (j < cells.size() && cells[j] == cells[j - 1] + 1) {
      ++j;
    }
    const Rectangle run{coordinate(cells[i], 2), coordinate(cells[i], 1), coordinate(cells[i], 1) + 1,
                        coordinate(cells[i], 0), coordinate(cells[j - 1], 0) + 1};
    i = j;
    if (const std::pair id{run.plane, run.u_begin}; id != row_id) {
      const bool follows = id.first == row_id.first && id.second == row_id.second + 1;
      previous_row = follows ? std::move(row) : std::vector<std::size_t>{};
      row.clear();
      row_id = id;
      candidate = 0;
    }
    while (candidate < previous_row.size() && rectangles[previous_row[candidate]].v_begin < run.v_begin) {
      ++candidate;
    }
    if (candidate < previous_row.size() && rectangles[previous_row[candidate]].v_begin == run.v_begin &&
        rectangles[previous_row[candidate]].v_end == run.v_end) {
      rectangles[previous_row[candidate]].u_end = run.u_end;
      row.push_back(previous_row[candidate]);
    } else {
      row.push_back(rectangles.size());
      rectangles.push_back(run);
    }
  }
  return rectangles;
}

void append_rectangle(const Rectangle& r, std::size_t axis, bool positive, const Eigen::Vector3d& edge_m,
                      TriangleMesh& mesh) {
  const auto u_axis = static_cast<Eigen::Index>((axis + 1) % 3);
  const auto v_axis = static_cast<Eigen::Index>((axis + 2) % 3);
  const auto n_axis = static_cast<Eigen::Index>(axis);
  const auto corner = [&](std::int64_t u, std::int64_t v) {
    Eigen::Vector3d point;
    point[n_axis] = static_cast<double>(r.plane + (positive ? 1 : 0)) * edge_m[n_axis];
    point[u_axis] = static_cast<double>(u) * edge_m[u_axis];
    point[v_axis] = static_cast<double>(v) * edge_m[v_axis];
    mesh.vertices_m.push_back(point.cast<float>());
  };
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  corner(r.u_begin, r.v_begin);
  corner(r.u_end, r.v_begin);
  corner(r.u_end, r.v_end);
  corner(r.u_begin, r.v_end);
  if (positive) {
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  } else {
    mesh.triangles.push_back({first, first + 2, first + 1});
    mesh.triangles.push_back({first, first + 3, first + 2});
  }
}

}  // namespace

void SolidVoxels::settle() {
  if (!std::is_sorted(keys_.begin(), keys_.end())) {
    std::sort(keys_.begin(), keys_.end());
  }
  keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
}

void SolidVoxels::close_gaps() {
  settle();
  std::vector<std::uint64_t> between;
  for (const unsigned shift : kShift) {
    const std::uint64_t step = std::uint64_t{1} << shift;
    std::size_t near = 0;
    std::size_t far = 0;
    for (const std::uint64_t key : keys_) {
      while (near < keys_.size() && keys_[near] < key + step) ++near;
      while (far < keys_.size() && keys_[far] < key + 2 * step) ++far;
      const bool filled = near < keys_.size() && keys_[near] == key + step;
      if (!filled && far < keys_.size() && keys_[far] == key + 2 * step) between.push_back(key + step);
    }
  }
  keys_.insert(keys_.end(), between.begin(), between.end());
  settle();
}

TriangleMesh SolidVoxels::exposed_faces(const Eigen::Vector3d& edge_m) {
  settle();
  TriangleMesh mesh;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const bool positive : {false, true}) {
      for (const Rectangle& rectangle : merge_faces(exposed_cells(keys_, axis, positive), axis)) {
        append_rectangle(rectangle, axis, positive, edge_m, mesh);
      }
    }
  }
  return mesh;
}

}  // namespace stairwell::sim3d
