#include "core/errors.hpp"
#include "core/pose.hpp"
#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"
#include "sim3d/loaders/primitives.hpp"

#include <sdf/sdf.hh>

#include <iostream>
#include <map>
#include <streambuf>

namespace stairwell::sim3d {

namespace {

Eigen::Vector3d eigen_of(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

Pose eigen_of(const ignition::math::Pose3d& pose) {
  const auto& q = pose.Rot();
  Pose result = Pose::Identity();
  result.translation() = eigen_of(pose.Pos());
  result.linear() = Eigen::Quaterniond(q.W(), q.X(), q.Y(), q.Z()).toRotationMatrix();
  return result;
}

std::string text_of(const sdf::Errors& errors) {
  std::string text;
  for (std::size_t i = 0; i < errors.size() && i < 3; ++i) {
    text += (i == 0 ? "" : "; ") + errors[i].Message();
  }
  return text.substr(0, 300);
}

/// SDFormat and the URDF reader it falls back on write to the standard streams. While one of these lives, what any
/// thread writes there is lost.
class SilencedStreams {
 public:
  SilencedStreams() : error_(std::cerr.rdbuf(nullptr)), output_(std::cout.rdbuf(nullptr)) {}
  ~SilencedStreams() {
    std::cerr.rdbuf(error_);  // clears the error flags too
    std::cout.rdbuf(output_);
  }
  SilencedStreams(const SilencedStreams&) = delete;
  SilencedStreams& operator=(const SilencedStreams&) = delete;

 private:
  std::streambuf* error_;
  std::streambuf* output_;
};

/// A file that a document names: relative to the document, or `model://NAME/...` in the folders around it.
std::filesystem::path find_named(const std::string& uri, const std::filesystem::path& folder) {
  if (uri.starts_with("file://")) {
    const std::filesystem::path path = uri.substr(7);
    return path.is_absolute() ? path : folder / path;
  }
  const bool of_model = uri.starts_with("model://") || uri.starts_with("package://");
  std::filesystem::path relative = of_model ? uri.substr(uri.find("://") + 3) : uri;
  if (relative.is_absolute()) {
    return relative;
  }
  std::filesystem::path root = folder;
  constexpr int kParents = 3;  // models/NAME/meshes beside worlds/FILE
  for (int i = 0; i <= (of_model ? kParents : 0); ++i) {
    for (const auto& candidate : {root / relative, root / "models" / relative}) {
      std::error_code error;
      if (std::filesystem::exists(candidate, error)) {
        return candidate;
      }
    }
    root /= "..";
  }
  return folder / relative;
}

/// Collects the geometry of a document in the world frame.
class SdfCollector {
 public:
  explicit SdfCollector(const std::filesystem::path& file) : file_(file) {}

  void add_model(const sdf::Model& model, const Pose& T_world_parent) {
    const Pose T_world_model = T_world_parent * resolve(model, model.Name());
    for (std::uint64_t i = 0; i < model.LinkCount(); ++i) {
      add_link(*model.LinkByIndex(i), T_world_model);
    }
    for (std::uint64_t i = 0; i < model.ModelCount(); ++i) {
      add_model(*model.ModelByIndex(i), T_world_model);
    }
  }

  TriangleMesh mesh{};

 private:
  template <typename Element>
  Pose resolve(const Element& element, const std::string& name) const {
    ignition::math::Pose3d pose;
    const sdf::Errors errors = element.SemanticPose().Resolve(pose);
    if (!errors.empty()) {
      // Without a world around it a model has no frame to resolve into; its pose is then the plain one.
      if (!element.PoseRelativeTo().empty()) {
        fail_input(file_, "the pose of '" + name + "' cannot be resolved: " + text_of(errors));
      }
      pose = element.RawPose();
    }
    Pose result = eigen_of(pose);
    if (!result.matrix().allFinite()) {
      fail_input(file_, "the pose of '" + name + "' is not finite");
    }
    return result;
  }

  void add_link(const sdf::Link& link, const Pose& T_world_model) {
    const Pose T_world_link = T_world_model * resolve(link, link.Name());
    for (std::uint64_t i = 0; i < link.CollisionCount(); ++i) {
      const sdf::Collision& collision = *link.CollisionByIndex(i);
      add_geometry(collision.Geom(), T_world_link * resolve(collision, collision.Name()), collision.Name());
    }
    for (std::uint64_t i = 0; link.CollisionCount() == 0 && i < link.VisualCount(); ++i) {
      const sdf::Visual& visual = *link.VisualByIndex(i);
      add_geometry(visual.Geom(), T_world_link * resolve(visual, visual.Name()), visual.Name());
    }
  }

  void add_geometry(const sdf::Geometry* geometry, const Pose& T_world_shape, const std::string& name) {
    if (geometry == nullptr) {
      return;
    }
    TriangleMesh shape = shape_of(*geometry, name);
    for (Eigen::Vector3f& vertex : shape.vertices_m) {
      vertex = (T_world_shape * vertex.cast<double>()).cast<float>();
    }
    mesh.append(shape);
  }

  TriangleMesh shape_of(const sdf::Geometry& geometry, const std::string& name) {
    switch (geometry.Type()) {
      case sdf::GeometryType::EMPTY:
        return {};
      case sdf::GeometryType::BOX:
        return box_mesh(eigen_of(geometry.BoxShape()->Size()));
      case sdf::GeometryType::CYLINDER:
        return cylinder_mesh(geometry.CylinderShape()->Radius(), geometry.CylinderShape()->Length());
      case sdf::GeometryType::SPHERE:
        return ellipsoid_mesh(Eigen::Vector3d::Constant(geometry.SphereShape()->Radius()));
      case sdf::GeometryType::ELLIPSOID:
        return ellipsoid_mesh(eigen_of(geometry.EllipsoidShape()->Radii()));
      case sdf::GeometryType::CAPSULE:
        return capsule_mesh(geometry.CapsuleShape()->Radius(), geometry.CapsuleShape()->Length());
      case sdf::GeometryType::PLANE: {
        const auto& size = geometry.PlaneShape()->Size();
        return plane_mesh(eigen_of(geometry.PlaneShape()->Normal()), {size.X(), size.Y()});
      }
      case sdf::GeometryType::MESH:
        return named_mesh(*geometry.MeshShape());
      default:
        fail_input(file_, "'" + name + "' has a kind of geometry that is not supported (heightmap or newer); " +
                              "export it as a mesh");
    }
  }

  TriangleMesh named_mesh(const sdf::Mesh& source) {
    const std::filesystem::path document = source.FilePath().empty() ? file_ : std::filesystem::path(source.FilePath());
    const std::filesystem::path path = find_named(source.Uri(), document.parent_path());
    const std::vector<MeshPart>& parts = parts_of(path, source.Uri());
    TriangleMesh result;
    for (const MeshPart& part : parts) {
      if (source.Submesh().empty() || part.name == source.Submesh()) {
        result.append(part.mesh);
      }
    }
    if (result.triangles.empty()) {
      fail_input(file_, "mesh '" + source.Uri() + "' has no triangles" +
                            (source.Submesh().empty() ? "" : " in a submesh named '" + source.Submesh() + "'"));
    }
    if (source.CenterSubmesh() && !source.Submesh().empty()) {
      const Eigen::Vector3f center = result.bounds().center_m().cast<float>();
      for (Eigen::Vector3f& vertex : result.vertices_m) {
        vertex -= center;
      }
    }
    for (Eigen::Vector3f& vertex : result.vertices_m) {
      vertex = eigen_of(source.Scale()).cwiseProduct(vertex.cast<double>()).cast<float>();
    }
    return result;
  }

  const std::vector<MeshPart>& parts_of(const std::filesystem::path& path, const std::string& uri) {
    const auto known = meshes_.find(path);
    if (known != meshes_.end()) {
      return known->second;
    }
    std::error_code error;
    if (!std::filesystem::exists(path, error)) {
      fail_input(file_, "names the mesh '" + uri + "', which is not there (looked for " + path.string() + ")");
    }
    if (!is_mesh_extension(lower_extension(path))) {
      fail_input(file_, "names the mesh '" + uri + "' of an unknown kind; known are .stl .obj .dae .ply .glb .gltf");
    }
    return meshes_.emplace(path, load_mesh_parts(path)).first->second;
  }

  const std::filesystem::path& file_;
  std::map<std::filesystem::path, std::vector<MeshPart>> meshes_;
};

sdf::Root read_document(const std::filesystem::path& file) {
  sdf::Console::Instance()->SetQuiet(true);
  const std::filesystem::path folder = file.parent_path();
  sdf::ParserConfig config;
  config.SetWarningsPolicy(sdf::EnforcementPolicy::LOG);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::LOG);
  config.SetFindCallback([&folder](const std::string& uri) {
    const std::filesystem::path found = find_named(uri, folder);
    std::error_code error;
    return std::filesystem::exists(found, error) ? found.string() : std::string();
  });
  sdf::Root root;
  const SilencedStreams silenced;
  // A relative name such as world.sdf would be found among SDFormat's own descriptions first.
  const std::string whole_name = std::filesystem::absolute(file).string();
  const sdf::Errors errors = root.Load(whole_name, config);
  if (!errors.empty() && errors.front().Message() == "Unable to read file:" + whole_name) {
    fail_input(file, "is not well-formed XML with an <sdf> element in it; mend or export it again");
  }
  if (!errors.empty()) {
    fail_input(file, "is not a usable SDFormat file: " + text_of(errors));
  }
  return root;
}

}  // namespace

TriangleMesh load_sdf(const std::filesystem::path& file) {
  try {
    const sdf::Root root = read_document(file);
    SdfCollector collector(file);
    for (std::uint64_t w = 0; w < root.WorldCount(); ++w) {
      const sdf::World& world = *root.WorldByIndex(w);
      for (std::uint64_t i = 0; i < world.ModelCount(); ++i) {
        collector.add_model(*world.ModelByIndex(i), Pose::Identity());
      }
    }
    if (root.Model() != nullptr) {
      collector.add_model(*root.Model(), Pose::Identity());
    }
    return std::move(collector.mesh);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    fail_input(file, "is not a usable SDFormat file: " + std::string(error.what()).substr(0, 300));
  }
}

}  // namespace stairwell::sim3d
