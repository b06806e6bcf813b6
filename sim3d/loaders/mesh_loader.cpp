#include "sim3d/loaders/input_file.hpp"
#include "sim3d/loaders/loaders.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>

namespace stairwell::sim3d {

namespace {

Eigen::Matrix4d eigen_of(const aiMatrix4x4& m) {
  Eigen::Matrix4d matrix;
  for (unsigned row = 0; row < 4; ++row) {
    for (unsigned column = 0; column < 4; ++column) {
      matrix(row, column) = static_cast<double>(m[row][column]);
    }
  }
  return matrix;
}

/// Lines and points stay behind: only faces of three corners.
TriangleMesh convert(const aiMesh& source, const Eigen::Matrix4d& T_world_mesh) {
  TriangleMesh mesh;
  mesh.vertices_m.reserve(source.mNumVertices);
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiVector3D& v = source.mVertices[i];
    const Eigen::Vector4d point(static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z), 1.0);
    mesh.vertices_m.push_back((T_world_mesh * point).head<3>().cast<float>());
  }
  for (unsigned i = 0; i < source.mNumFaces; ++i) {
    const aiFace& face = source.mFaces[i];
    if (face.mNumIndices == 3) {
      mesh.triangles.push_back({face.mIndices[0], face.mIndices[1], face.mIndices[2]});
    }
  }
  return mesh;
}

void collect(const aiScene& scene, const aiNode& node, const Eigen::Matrix4d& T_world_parent,
             std::vector<MeshPart>& parts) {
  const Eigen::Matrix4d T_world_node = T_world_parent * eigen_of(node.mTransformation);
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const unsigned index = node.mMeshes[i];
    if (index < scene.mNumMeshes) {
      parts.push_back({node.mName.C_Str(), convert(*scene.mMeshes[index], T_world_node)});
    }
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) {
    collect(scene, *node.mChildren[i], T_world_node, parts);
  }
}

/// The blocks of a binary glTF file (12 bytes header; then length, kind and content of each) must end where it ends.
void check_blocks(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  std::size_t at = 12;
  while (bytes.starts_with("glTF") && at < bytes.size()) {
    const std::size_t length = bytes.size() - at < 8 ? bytes.size() : read_value<std::uint32_t>(bytes, at);
    if (length > bytes.size() - std::min(at + 8, bytes.size())) {
      fail_input(file, "is truncated or damaged: a block reaches beyond its end; export it again");
    }
    at += 8 + length;
  }
}

/// Index lists of a .dae must hold whole numbers only: Assimp's reader never gets past anything else.
void check_index_lists(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  for (const std::string_view tag : {"<p", "<vcount", "<v"}) {
    for (std::size_t at = bytes.find(tag); at != std::string::npos; at = bytes.find(tag, at + 1)) {
      const std::size_t name_end = at + tag.size();
      if (bytes.find_first_of("> \t\r\n", name_end) != name_end) {
        continue;  // another, longer name
      }
      const std::size_t begin = std::min(bytes.find('>', name_end), bytes.size() - 1) + 1;
      const std::size_t end = std::min(bytes.find('<', begin), bytes.size());
      if (bytes.find_first_not_of("0123456789 \t\r\n", begin) < end) {
        fail_input(file, "is damaged: an index list <" + std::string(tag.substr(1)) +
                             "> holds more than whole numbers; export it again");
      }
    }
  }
}

/// Every value of a .dae or .glb takes at least a byte of the file, so a larger count is damage. Checked before the
/// library, which would first ask for the memory.
void check_counts(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  for (const std::string_view key : {"count", "byteLength"}) {
    for (std::size_t at = bytes.find(key); at != std::string::npos; at = bytes.find(key, at + 1)) {
      const std::size_t begin = std::min(bytes.find_first_not_of(" \t\r\n\"'=:", at + key.size()), bytes.size());
      const std::size_t end = std::min(bytes.find_first_not_of("0123456789", begin), bytes.size());
      const std::string_view digits = std::string_view(bytes).substr(begin, end - begin);
      if (!digits.empty() && parse_number<std::size_t>(digits).value_or(bytes.size() + 1) > bytes.size()) {
        fail_input(file, "is truncated or damaged: it promises " + std::string(digits.substr(0, 30)) +
                             " values, more than it is long; export it again");
      }
    }
  }
}

}  // namespace

std::vector<MeshPart> load_scene(const std::filesystem::path& file) {
  require_file(file);
  if (lower_extension(file) != ".gltf") {  // its values may lie in other files
    check_counts(file);
  }
  if (lower_extension(file) == ".dae") {
    check_index_lists(file);
  }
  if (lower_extension(file) == ".glb") {
    check_blocks(file);
  }
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_SortByPType);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    const std::string why = importer.GetErrorString();
    fail_input(file, why.starts_with("No suitable reader")
                         ? "is not a " + lower_extension(file) + " file inside, or is truncated; export it again"
                         : "cannot be read as a mesh (" + why.substr(0, 200) + "); export it again");
  }
  // Assimp hands these formats out with y up, whatever the file says.
  Eigen::Matrix4d T_zup_yup = Eigen::Matrix4d::Zero();
  T_zup_yup(0, 0) = 1.0;
  T_zup_yup(1, 2) = -1.0;
  T_zup_yup(2, 1) = 1.0;
  T_zup_yup(3, 3) = 1.0;
  std::vector<MeshPart> parts;
  collect(*scene, *scene->mRootNode, T_zup_yup, parts);
  return parts;
}

bool is_mesh_extension(const std::string& extension) {
  return extension == ".stl" || extension == ".obj" || extension == ".ply" || extension == ".dae" ||
         extension == ".glb" || extension == ".gltf";
}

std::vector<MeshPart> load_mesh_parts(const std::filesystem::path& file) {
  const std::string extension = lower_extension(file);
  const auto whole = [](TriangleMesh mesh) {
    std::vector<MeshPart> parts(1);
    parts[0].mesh = std::move(mesh);
    return parts;
  };
  if (extension == ".stl") {
    return whole(load_stl(file));
  }
  if (extension == ".ply") {
    return whole(load_ply(file));
  }
  return extension == ".obj" ? load_obj(file) : load_scene(file);
}

}  // namespace stairwell::sim3d
