/// FCL's collision checker over an OctoMap tree: the oracle, and what the benchmark compares with.
#pragma once

#include "core/pose.hpp"
#include "mapping/collision.hpp"

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <octomap/octomap.h>

#include <memory>
#include <utility>
#include <variant>
#include <vector>

namespace stairwell::checkers {

inline std::shared_ptr<fcl::CollisionGeometryd> fcl_shape(const mapping::CollisionShape& shape) {
  struct Make {
    std::shared_ptr<fcl::CollisionGeometryd> operator()(const mapping::SphereShape& s) const {
      return std::make_shared<fcl::Sphered>(s.radius_m);
    }
    std::shared_ptr<fcl::CollisionGeometryd> operator()(const mapping::BoxShape& s) const {
      return std::make_shared<fcl::Boxd>(2.0 * s.half_m);
    }
    std::shared_ptr<fcl::CollisionGeometryd> operator()(const mapping::EllipsoidShape& s) const {
      return std::make_shared<fcl::Ellipsoidd>(s.semi_axes_m);
    }
    std::shared_ptr<fcl::CollisionGeometryd> operator()(const mapping::CylinderShape& s) const {
      return std::make_shared<fcl::Cylinderd>(s.radius_m, 2.0 * s.half_height_m);
    }
  };
  auto made = std::visit(Make{}, shape);
  made->computeLocalAABB();
  return made;
}

/// The map's obstacles as an OcTree of nothing but occupied leaves, pruned. Voxels outside the grid are left out.
inline std::shared_ptr<octomap::OcTree> obstacle_tree(const mapping::OccupancyMap& map, mapping::Obstacles obstacles) {
  const GridSpec& grid = map.grid();
  auto tree = std::make_shared<octomap::OcTree>(grid.resolution_m());
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    const bool obstacle =
        obstacles == mapping::Obstacles::kBlocked ? map.blocked(v) : map.at(v) == Occupancy::kOccupied;
    if (!obstacle) continue;
    const auto key = [&grid](std::size_t axis, int cell) {
      return static_cast<octomap::key_type>(grid.first_cell()[axis] + cell + 32768);
    };
    tree->setNodeValue(octomap::OcTreeKey(key(0, v.x), key(1, v.y), key(2, v.z)), 2.0F, true);
  }
  tree->updateInnerOccupancy();
  tree->prune();
  return tree;
}

/// fcl::OcTree against one shape: FCL descends the octree and asks the solver at its leaves.
class FclOctree {
 public:
  FclOctree(std::shared_ptr<const octomap::OcTree> tree, const mapping::CollisionShape& shape,
            fcl::GJKSolverType solver = fcl::GST_LIBCCD)
      : octree_(std::make_shared<fcl::OcTreed>(std::move(tree))), shape_(fcl_shape(shape)) {
    octree_->computeLocalAABB();
    request_.gjk_solver_type = solver;
  }
  bool collides(const Pose& T_world_body) const {
    fcl::CollisionResultd result;
    return fcl::collide(octree_.get(), fcl::Transform3d::Identity(), shape_.get(), T_world_body, request_, result) > 0;
  }

 private:
  std::shared_ptr<fcl::OcTreed> octree_;
  std::shared_ptr<fcl::CollisionGeometryd> shape_;
  fcl::CollisionRequestd request_;
};

/// One fcl::Box for every leaf of the tree in FCL's dynamic AABB tree: FCL's broadphase.
class FclBoxes {
 public:
  FclBoxes(const octomap::OcTree& tree, const mapping::CollisionShape& shape) : shape_(fcl_shape(shape)) {
    for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
      if (!tree.isNodeOccupied(*leaf)) continue;
      auto box = std::make_shared<fcl::Boxd>(leaf.getSize(), leaf.getSize(), leaf.getSize());
      fcl::Transform3d T_world_box = fcl::Transform3d::Identity();
      T_world_box.translation() = fcl::Vector3d(leaf.getX(), leaf.getY(), leaf.getZ());
      boxes_.push_back(std::make_unique<fcl::CollisionObjectd>(box, T_world_box));
    }
    std::vector<fcl::CollisionObjectd*> all;
    for (const auto& box : boxes_) all.push_back(box.get());
    manager_.registerObjects(all);
    manager_.setup();
  }
  bool collides(const Pose& T_world_body) const {
    fcl::CollisionObjectd body(shape_, T_world_body);
    bool found = false;
    manager_.collide(&body, &found, [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
      const fcl::CollisionRequestd request;
      fcl::CollisionResultd result;
      bool& any = *static_cast<bool*>(data);
      any = fcl::collide(a, b, request, result) > 0;
      return any;
    });
    return found;
  }

 private:
  std::shared_ptr<fcl::CollisionGeometryd> shape_;
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> boxes_;
  mutable fcl::DynamicAABBTreeCollisionManagerd manager_;
};

}  // namespace stairwell::checkers
