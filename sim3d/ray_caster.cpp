#include "sim3d/ray_caster.hpp"

#include "core/errors.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstddef>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

namespace stairwell::sim3d {

namespace {

constexpr std::size_t kPacket = 16;  // Embree splits it by itself where 16 lanes are not native
constexpr int kTile = 4;             // a packet of neighbours in a lattice is a narrow bundle, not a long row
constexpr float kCrack_m = 0.02f;    // what a ray may slip by through a crack between triangles
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Rays that are cast together.
class Packet {
 public:
  void set(std::size_t lane, const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction, float max_range_m) {
    valid_[lane] = -1;
    RTCRay16& ray = rays_.ray;
    ray.org_x[lane] = origin_m.x();
    ray.org_y[lane] = origin_m.y();
    ray.org_z[lane] = origin_m.z();
    ray.dir_x[lane] = direction.x();
    ray.dir_y[lane] = direction.y();
    ray.dir_z[lane] = direction.z();
    ray.tnear[lane] = 0.0f;
    ray.tfar[lane] = max_range_m;
    ray.time[lane] = 0.0f;
    ray.mask[lane] = ~0u;
    ray.id[lane] = 0;
    ray.flags[lane] = 0;
    rays_.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    rays_.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }

  /// The lanes below `lanes`, which have been set.
  void cast(RTCScene scene, RTCIntersectContextFlags coherence, std::size_t lanes) {
    for (std::size_t lane = lanes; lane < kPacket; ++lane) valid_[lane] = 0;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherence;
    rtcIntersect16(valid_, scene, &context, &rays_);
  }

  float distance_m(std::size_t lane) const {
    return rays_.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID ? rays_.ray.tfar[lane] : kInfinity;
  }

 private:
  alignas(64) RTCRayHit16 rays_{};
  alignas(64) int valid_[kPacket]{};
};

/// Whether it reaches farther than both its neighbours beside it, or than both above and below, as a ray does that
/// slips between two triangles. There being no neighbour says nothing against it.
bool sticks_out(std::span<const float> distances_m, int columns, int column, int row) {
  const auto rows = static_cast<int>(distances_m.size()) / columns;
  const auto at = [&](int x, int y) { return distances_m[static_cast<std::size_t>(y * columns + x)]; };
  const float there_m = at(column, row) - kCrack_m;
  const auto beyond = [&](int x, int y) { return x < 0 || x >= columns || y < 0 || y >= rows || there_m > at(x, y); };
  return (beyond(column - 1, row) && beyond(column + 1, row)) || (beyond(column, row - 1) && beyond(column, row + 1));
}

RTCRay make_ray(const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction, float max_range_m) {
  RTCRay ray{};
  ray.org_x = origin_m.x();
  ray.org_y = origin_m.y();
  ray.org_z = origin_m.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tfar = max_range_m;
  ray.mask = ~0u;
  return ray;
}

void check_indices(const TriangleMesh& mesh) {
  for (const auto& triangle : mesh.triangles) {
    for (const auto vertex : triangle) {
      if (vertex >= mesh.vertices_m.size()) {
        throw std::invalid_argument("a triangle names vertex " + std::to_string(vertex) + " of only " +
                                    std::to_string(mesh.vertices_m.size()));
      }
    }
  }
}

}  // namespace

struct RayCaster::Impl {
  RTCDevice device = nullptr;
  RTCGeometry geometry = nullptr;  ///< none for an empty mesh
  RTCScene scene = nullptr;
  RTCScene fast_scene = nullptr;  ///< not watertight; made when it is first needed
  std::once_flag fast_scene_made;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (fast_scene != nullptr) rtcReleaseScene(fast_scene);
    if (scene != nullptr) rtcReleaseScene(scene);
    if (geometry != nullptr) rtcReleaseGeometry(geometry);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  void require_ok(const char* what) const {
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
      throw RunError(std::string("Embree cannot ") + what + " (error " + std::to_string(static_cast<int>(error)) + ")");
    }
  }

  void hold(const TriangleMesh& mesh) {
    geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.vertices_m.size()));
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
    if (vertices != nullptr && indices != nullptr) {
      for (const auto& vertex : mesh.vertices_m) vertices = std::copy_n(vertex.data(), 3, vertices);
      for (const auto& triangle : mesh.triangles) indices = std::copy_n(triangle.data(), 3, indices);
      rtcCommitGeometry(geometry);
    }
    require_ok("hold the mesh");
  }

  RTCScene make_scene(RTCSceneFlags flags) const {
    RTCScene made = rtcNewScene(device);
    rtcSetSceneFlags(made, flags);
    rtcSetSceneBuildQuality(made, RTC_BUILD_QUALITY_HIGH);
    if (geometry != nullptr) rtcAttachGeometry(made, geometry);
    rtcCommitScene(made);
    require_ok("build its tree");
    return made;
  }

  template <typename SetLane>
  void cast_packets(std::size_t count, RTCIntersectContextFlags coherence, const SetLane& set,
                    std::span<float> distances_m) const {
    Packet packet;
    for (std::size_t begin = 0; begin < count; begin += kPacket) {
      const std::size_t lanes = std::min(kPacket, count - begin);
      for (std::size_t lane = 0; lane < lanes; ++lane) set(packet, lane, begin + lane);
      packet.cast(scene, coherence, lanes);
      for (std::size_t lane = 0; lane < lanes; ++lane) distances_m[begin + lane] = packet.distance_m(lane);
    }
  }
};

RayCaster::RayCaster(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  check_indices(mesh);
  // One build thread: the tree, and so the choice between equally near triangles, is the same every time.
  impl_->device = rtcNewDevice("threads=1,verbose=0");
  if (impl_->device == nullptr) throw RunError("Embree cannot start a device");
  if (!mesh.triangles.empty()) impl_->hold(mesh);
  impl_->scene = impl_->make_scene(RTC_SCENE_FLAG_ROBUST);
}

RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;

RayHit RayCaster::cast(const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction, float max_range_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = make_ray(origin_m, direction, max_range_m);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &context, &query);
  RayHit hit;
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.distance_m = query.ray.tfar;
  hit.triangle = query.hit.primID;
  hit.normal = {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z};
  return hit;
}

void RayCaster::cast_from(const Eigen::Vector3f& origin_m, std::span<const Eigen::Vector3f> directions,
                          float max_range_m, std::span<float> distances_m) const {
  if (directions.size() != distances_m.size()) {
    throw std::invalid_argument("cast_from: one distance per direction is needed");
  }
  const auto set = [&](Packet& packet, std::size_t lane, std::size_t ray) {
    packet.set(lane, origin_m, directions[ray], max_range_m);
  };
  impl_->cast_packets(directions.size(), RTC_INTERSECT_CONTEXT_FLAG_COHERENT, set, distances_m);
}

void RayCaster::cast_lattice(const Eigen::Vector3f& origin_m, std::span<const Eigen::Vector3f> directions, int columns,
                             float max_range_m, std::span<float> distances_m) const {
  if (directions.size() != distances_m.size() || columns < 1 ||
      directions.size() % static_cast<std::size_t>(columns) != 0) {
    throw std::invalid_argument("cast_lattice: whole rows, with one distance per direction, are needed");
  }
  const auto rows = static_cast<int>(directions.size()) / columns;
  std::call_once(impl_->fast_scene_made, [this] { impl_->fast_scene = impl_->make_scene(RTC_SCENE_FLAG_NONE); });
  Packet packet;
  const auto cast_chosen = [&](RTCScene scene, RTCIntersectContextFlags coherence, std::span<const std::size_t> rays) {
    for (std::size_t begin = 0; begin < rays.size(); begin += kPacket) {
      const auto chosen = rays.subspan(begin, std::min(kPacket, rays.size() - begin));
      for (std::size_t lane = 0; lane < chosen.size(); ++lane)
        packet.set(lane, origin_m, directions[chosen[lane]], max_range_m);
      packet.cast(scene, coherence, chosen.size());
      for (std::size_t lane = 0; lane < chosen.size(); ++lane) distances_m[chosen[lane]] = packet.distance_m(lane);
    }
  };
  std::vector<std::size_t> rays;
  for (int row = 0; row < rows; row += kTile) {
    for (int column = 0; column < columns; column += kTile) {
      rays.clear();
      for (int y = row; y < std::min(rows, row + kTile); ++y)
        for (int x = column; x < std::min(columns, column + kTile); ++x)
          rays.push_back(static_cast<std::size_t>(y * columns + x));
      cast_chosen(impl_->fast_scene, RTC_INTERSECT_CONTEXT_FLAG_COHERENT, rays);
    }
  }
  rays.clear();
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      if (sticks_out(distances_m, columns, column, row))
        rays.push_back(static_cast<std::size_t>(row * columns + column));
  cast_chosen(impl_->scene, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT, rays);
}

void RayCaster::cast_many(std::span<const Eigen::Vector3f> origins_m, std::span<const Eigen::Vector3f> directions,
                          std::span<const float> max_ranges_m, std::span<float> distances_m) const {
  if (origins_m.size() != directions.size() || origins_m.size() != max_ranges_m.size() ||
      origins_m.size() != distances_m.size()) {
    throw std::invalid_argument("cast_many: one direction, range and distance per origin are needed");
  }
  const auto set = [&](Packet& packet, std::size_t lane, std::size_t ray) {
    packet.set(lane, origins_m[ray], directions[ray], max_ranges_m[ray]);
  };
  impl_->cast_packets(origins_m.size(), RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT, set, distances_m);
}

bool RayCaster::occluded(const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction, float max_range_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = make_ray(origin_m, direction, max_range_m);
  rtcOccluded1(impl_->scene, &context, &ray);
  return ray.tfar < 0.0f;
}

}  // namespace stairwell::sim3d
