#include "sim3d/ray_caster.hpp"

#include "core/errors.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace stairwell::sim3d {

namespace {

constexpr std::size_t kPacket = 16;  // Embree splits it by itself where 16 lanes are not native
constexpr float kInfinity = std::numeric_limits<float>::infinity();

void fill_lane(RTCRayHit16& packet, std::size_t lane, const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction,
               float max_range_m) {
  RTCRay16& ray = packet.ray;
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
  packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
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
  RTCScene scene = nullptr;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  void require_ok(const char* what) const {
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
      throw RunError(std::string("Embree cannot ") + what + " (error " + std::to_string(static_cast<int>(error)) + ")");
    }
  }

  void attach(const TriangleMesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.vertices_m.size()));
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
    if (vertices != nullptr && indices != nullptr) {
      for (const auto& vertex : mesh.vertices_m) vertices = std::copy_n(vertex.data(), 3, vertices);
      for (const auto& triangle : mesh.triangles) indices = std::copy_n(triangle.data(), 3, indices);
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(scene, geometry);
    }
    rtcReleaseGeometry(geometry);
    require_ok("hold the mesh");
  }

  template <typename FillLane>
  void cast_packets(std::size_t count, RTCIntersectContextFlags coherence, const FillLane& fill,
                    std::span<float> distances_m) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherence;
    alignas(64) RTCRayHit16 packet{};
    alignas(64) int valid[kPacket];
    for (std::size_t begin = 0; begin < count; begin += kPacket) {
      const std::size_t lanes = std::min(kPacket, count - begin);
      for (std::size_t lane = 0; lane < kPacket; ++lane) {
        valid[lane] = lane < lanes ? -1 : 0;
        if (lane < lanes) fill(packet, lane, begin + lane);
      }
      rtcIntersect16(valid, scene, &context, &packet);
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const bool hit = packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
        distances_m[begin + lane] = hit ? packet.ray.tfar[lane] : kInfinity;
      }
    }
  }
};

RayCaster::RayCaster(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  check_indices(mesh);
  // One build thread: the tree, and so the choice between equally near triangles, is the same every time.
  impl_->device = rtcNewDevice("threads=1,verbose=0");
  if (impl_->device == nullptr) throw RunError("Embree cannot start a device");
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_HIGH);
  if (!mesh.triangles.empty()) impl_->attach(mesh);
  rtcCommitScene(impl_->scene);
  impl_->require_ok("build its tree");
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
  const auto fill = [&](RTCRayHit16& packet, std::size_t lane, std::size_t ray) {
    fill_lane(packet, lane, origin_m, directions[ray], max_range_m);
  };
  impl_->cast_packets(directions.size(), RTC_INTERSECT_CONTEXT_FLAG_COHERENT, fill, distances_m);
}

void RayCaster::cast_many(std::span<const Eigen::Vector3f> origins_m, std::span<const Eigen::Vector3f> directions,
                          std::span<const float> max_ranges_m, std::span<float> distances_m) const {
  if (origins_m.size() != directions.size() || origins_m.size() != max_ranges_m.size() ||
      origins_m.size() != distances_m.size()) {
    throw std::invalid_argument("cast_many: one direction, range and distance per origin are needed");
  }
  const auto fill = [&](RTCRayHit16& packet, std::size_t lane, std::size_t ray) {
    fill_lane(packet, lane, origins_m[ray], directions[ray], max_ranges_m[ray]);
  };
  impl_->cast_packets(origins_m.size(), RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT, fill, distances_m);
}

bool RayCaster::occluded(const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction, float max_range_m) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = make_ray(origin_m, direction, max_range_m);
  rtcOccluded1(impl_->scene, &context, &ray);
  return ray.tfar < 0.0f;
}

}  // namespace stairwell::sim3d
