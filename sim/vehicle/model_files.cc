#include "sim/vehicle/model_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <new>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "sim/base/check.h"
#include "sim/base/digest.h"
#include "sim/vehicle/mjcf_tags.h"
#include "sim/vehicle/model_contents.h"
#include "sim/vehicle/model_limits.h"
#include "sim/vehicle/mujoco_handlers.h"
#include "sim/vehicle/part_angles.h"

namespace turbidock::vehicle {
namespace {

namespace fs = std::filesystem;

using Contents = std::map<std::string, std::string>;

// A file's bytes, noted in `contents` unless that is null.
std::string Read(const fs::path& path, Contents* contents) {
  std::string bytes = ReadModelFile(path);
  if (contents) (*contents)[path.lexically_normal().string()] = DigestOf(bytes);
  return bytes;
}

std::string ReadXml(const fs::path& path, Contents* contents) {
  std::string xml = Read(path, contents);
  if (xml.find('\0') != std::string::npos)  // where MuJoCo's texts end and ours do not
    throw ConfigError(path.string() + ": holds a null character, which no XML does");
  return xml;
}

// What holds for the whole scene is not a part's to say.
void RequireOfPart(const Tag& tag, const std::string& where) {
  constexpr std::array kOfScene = {"option", "statistic", "visual", "equality", "contact"};
  const bool is_of_scene = std::ranges::find(kOfScene, tag.name) != kOfScene.end();
  if (is_of_scene)
    throw ConfigError(where + "<" + tag.name + "> is the scene's, which a part must not change");
  if (tag.name == "composite")
    throw ConfigError(where + "<composite> is many bodies, a part is one");
  if (tag.name != "compiler") return;
  for (const auto& [key, value] : tag.attributes) {
    // angles are turned into the scene's; no limits are allowed that autolimits would ask
    if (key == "angle" || key == "eulerseq" || key == "autolimits") continue;
    std::string said = where;
    said.append("<compiler ")
        .append(key)
        .append("=\"")
        .append(value)
        .append("\"> is the scene's: ");
    throw ConfigError(said + (key == "meshdir" || key == "texturedir"
                                  ? "leave it out, and write the folder into each file=\"...\""
                                  : "leave it out"));
  }
}

// Files in memory that MuJoCo takes before those on disk.
class FilesInMemory {
 public:
  FilesInMemory() { mj_defaultVFS(files_.get()); }
  ~FilesInMemory() { mj_deleteVFS(files_.get()); }
  FilesInMemory(const FilesInMemory&) = delete;
  FilesInMemory& operator=(const FilesInMemory&) = delete;

  bool Has(const std::string& name) const {
    return mj_findFileVFS(files_.get(), name.c_str()) >= 0;
  }
  // The file at `path`, which holds these bytes, under this name.
  void Add(const std::string& name, const fs::path& path, const std::string& bytes) {
    if (mj_makeEmptyFileVFS(files_.get(), name.c_str(), static_cast<int>(bytes.size())) != 0)
      throw ConfigError(path.string() + ": cannot be taken for " + name);
    const int file = mj_findFileVFS(files_.get(), name.c_str());
    std::memcpy(files_->filedata[file], bytes.data(), bytes.size());
  }

  const mjVFS* get() const { return files_.get(); }

 private:
  std::unique_ptr<mjVFS> files_ = std::make_unique<mjVFS>();
};

[[noreturn]] void SayNoFile(const std::string& where, const Tag& tag, const std::string& file,
                            const fs::path& path) {
  throw ConfigError(where + "<" + tag.name + " file=\"" + file + "\">: " + path.string() +
                    " is no file");
}

std::string WhereIn(const fs::path& path, const Tag& tag) {
  return path.string() + ":" + std::to_string(tag.line) + ": ";
}

// The tags of a scene and of what it includes from its own folder, each with its file; what is
// missing is MuJoCo's to say.
using PlacedTags = std::vector<std::pair<fs::path, Tag>>;
void GatherTags(const fs::path& path, const SceneFiles& scene, std::set<fs::path>* seen,
                PlacedTags* tags, Contents* contents) {
  std::error_code ignored;
  if (!seen->insert(path).second || !fs::is_regular_file(path, ignored)) return;
  for (const Tag& tag : TagsOf(ReadXml(path, contents))) {
    tags->emplace_back(path, tag);
    const std::string included = tag.name == "include" ? tag.attribute("file") : "";
    if (!included.empty() && !scene.parts.contains(included) && !scene.shared.contains(included))
      GatherTags(fs::path(scene.scene).parent_path() / included, scene, seen, tags, contents);
  }
}

// The scene's own meshes and pictures, which are where its <compiler> says.
void RequireFiles(const fs::path& scene, const PlacedTags& tags, Contents* contents) {
  std::string meshes, textures;
  bool strips_paths = false;
  for (const auto& [path, tag] : tags) {
    if (tag.name != "compiler") continue;
    for (const auto& [key, value] : tag.attributes) {
      if (key == "meshdir") meshes = value;
      if (key == "texturedir") textures = value;
      if (key == "strippath") strips_paths = value == "true";
    }
  }
  for (const auto& [path, tag] : tags) {
    RequireModest(tag, WhereIn(path, tag));
    for (const std::string& named : FilesOf(tag)) {
      const fs::path file = scene.parent_path() / (tag.name == "texture" ? textures : meshes) /
                            (strips_paths ? fs::path(named).filename() : fs::path(named));
      std::error_code ignored;
      if (!fs::exists(file, ignored)) continue;  // for MuJoCo to say
      // a pipe would be waited for
      if (!fs::is_regular_file(file, ignored)) SayNoFile(WhereIn(path, tag), tag, named, file);
      RequireSound(file, Read(file, contents));
    }
  }
}

// Takes a part, or another file that the scene lacks, under the name by which the scene includes
// it, with the meshes, pictures and further files of its own, which stand beside it. Files in
// memory go by their names without a folder, so that no two of a name can be told apart.
class Additions {
 public:
  // `scene_includes`: the names of what the scene has of its own.
  Additions(std::set<std::string> scene_includes, Contents* contents)
      : scene_includes_(std::move(scene_includes)), contents_(contents) {}

  // What the scene lacks has no angles of its own.
  void Add(const std::string& name, const fs::path& path,
           const std::optional<Angles>& part = std::nullopt) {
    const std::string model = ReadXml(path, contents_);
    files_.Add(name, path, part ? WithSceneAngles(model, *part) : model);
    for (const Tag& tag : TagsOf(model)) {
      RequireModest(tag, WhereIn(path, tag));
      if (part) RequireOfPart(tag, WhereIn(path, tag));
      if (part) RequireTurns(tag, *part, WhereIn(path, tag));
      // what the scene lacks includes the scene's files first, which MuJoCo finds
      if (part && tag.name == "include") AddIncluded(path, tag, *part);
      for (const std::string& named : FilesOf(tag)) AddNamed(path, tag, named);
    }
  }
  bool Has(const std::string& name) const { return files_.Has(name); }
  const mjVFS* get() const { return files_.get(); }

 private:
  // One that is not beside it may be the scene's.
  void AddIncluded(const fs::path& path, const Tag& tag, const Angles& part) {
    const fs::path file = path.parent_path() / tag.attribute("file");
    std::error_code ignored;
    if (files_.Has(file.filename()) || !fs::is_regular_file(file, ignored)) return;
    if (scene_includes_.contains(file.filename()))
      throw ConfigError(WhereIn(path, tag) + "<include file=\"" + tag.attribute("file") +
                        "\"> has the name of a file that the scene includes: rename it");
    Add(file.filename(), file, part);
  }

  void AddNamed(const fs::path& path, const Tag& tag, const std::string& named) {
    const fs::path file = path.parent_path() / named;
    if (files_.Has(file.filename())) return;
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) SayNoFile(WhereIn(path, tag), tag, named, file);
    const std::string bytes = Read(file, contents_);
    RequireSound(file, bytes);
    files_.Add(file.filename(), file, bytes);
  }

  const std::set<std::string> scene_includes_;
  Contents* const contents_;
  FilesInMemory files_;
};

// Looks at where things are and how large: MuJoCo takes any number, and none.
class Places {
 public:
  Places(const mjModel& model, const std::string& where) : model_(model), where_(where) {}

  // `width` numbers of each thing of a kind.
  void Require(mjtObj type, int count, const char* kind, const char* what, const mjtNum* values,
               int width) const {
    constexpr double kFarthest_m = 1e4;
    for (int i = 0; i < count * width; ++i) {
      if (std::abs(values[i]) <= kFarthest_m) continue;
      const char* name = mj_id2name(&model_, type, i / width);
      throw ConfigError(where_ + ": " + kind + " \"" + (name ? name : "") + "\": its " + what +
                        (std::isfinite(values[i]) ? " is beyond 10 km" : " is no number"));
    }
  }

 private:
  const mjModel& model_;
  const std::string& where_;
};

void RequirePlaces(const mjModel& m, const std::string& where) {
  const Places places(m, where);
  places.Require(mjOBJ_BODY, m.nbody, "body", "pos", m.body_pos, 3);
  places.Require(mjOBJ_BODY, m.nbody, "body", "orientation", m.body_quat, 4);
  places.Require(mjOBJ_BODY, m.nbody, "body", "inertial", m.body_ipos, 3);
  places.Require(mjOBJ_GEOM, m.ngeom, "geom", "pos", m.geom_pos, 3);
  places.Require(mjOBJ_GEOM, m.ngeom, "geom", "orientation", m.geom_quat, 4);
  places.Require(mjOBJ_GEOM, m.ngeom, "geom", "size", m.geom_size, 3);
  places.Require(mjOBJ_SITE, m.nsite, "site", "pos", m.site_pos, 3);
  places.Require(mjOBJ_SITE, m.nsite, "site", "orientation", m.site_quat, 4);
  places.Require(mjOBJ_SITE, m.nsite, "site", "size", m.site_size, 3);
  places.Require(mjOBJ_CAMERA, m.ncam, "camera", "pos", m.cam_pos, 3);
  places.Require(mjOBJ_CAMERA, m.ncam, "camera", "orientation", m.cam_quat, 4);
}

// How the compilers of a scene or part and of what it includes say that angles are given; the last
// one counts, as to MuJoCo.
Angles AnglesOf(const SceneFiles& files, Angles angles) {
  std::set<fs::path> seen;
  const std::function<void(const fs::path&)> read = [&](const fs::path& path) {
    std::error_code ignored;
    if (!seen.insert(path).second || !fs::is_regular_file(path, ignored)) return;
    for (const Tag& tag : TagsOf(ReadXml(path, nullptr))) {
      if (tag.name == "compiler") angles.Read(tag, WhereIn(path, tag));
      const std::string included = tag.name == "include" ? tag.attribute("file") : "";
      if (included.empty() || files.parts.contains(included)) continue;
      const auto shared = files.shared.find(included);
      read(shared != files.shared.end() ? fs::path(shared->second)
                                        : fs::path(files.scene).parent_path() / included);
    }
  };
  read(files.scene);
  return angles;
}

// Parts and bundled files have their angles in radians: in a scene of other angles each would mean
// another place.
void RequireRadians(const SceneFiles& scene) {
  const std::vector<Tag> tags = TagsOf(ReadXml(scene.scene, nullptr));
  if (std::ranges::find(tags, "include", &Tag::name) == tags.end()) return;
  const Angles angles = AnglesOf(scene, {.in_degrees = true});  // MuJoCo's default
  if (angles.in_degrees || angles.eulerseq != Angles().eulerseq)
    throw ConfigError(scene.scene +
                      ": its parts give angles in radians, about x, y and z in turn; so must it: "
                      "say <compiler angle=\"radian\"/>, without eulerseq");
}

// Looks at all files of a scene. What MuJoCo is to take from memory, if there is any.
std::unique_ptr<Additions> Gather(const SceneFiles& scene, Contents* contents) {
  std::set<fs::path> own;
  PlacedTags tags;
  GatherTags(scene.scene, scene, &own, &tags, contents);
  RequireFiles(scene.scene, tags, contents);
  if (scene.parts.empty() && scene.shared.empty()) return nullptr;  // megabytes
  RequireRadians(scene);
  std::set<std::string> names;
  for (const fs::path& file : own) names.insert(file.filename());
  auto files = std::make_unique<Additions>(std::move(names), contents);
  for (const auto& [name, file] : scene.parts) files->Add(name, file, AnglesOf({file}, {}));
  for (const auto& [name, file] : scene.shared)
    if (!files->Has(name)) files->Add(name, file);
  return files;
}

}  // namespace

std::map<std::string, std::string> ContentsOf(const SceneFiles& scene) {
  Contents contents;
  Gather(scene, &contents);
  return contents;
}

std::string Where(const SceneFiles& files) {
  std::string where = files.scene;
  for (const auto& [name, path] : files.parts)
    if (fs::path(path).filename() != name) where += " with " + path;
  return where;
}

MjModelPtr ReadModel(const SceneFiles& scene) {
  const std::string& path = scene.scene;
  const std::unique_ptr<Additions> files = Gather(scene, nullptr);
  std::string message;
  MjModelPtr model;
  try {
    const ThrowingMujocoErrors throwing;
    std::array<char, 1024> said{};
    model.reset(mj_loadXML(path.c_str(), files ? files->get() : nullptr, said.data(), said.size()));
    message = said.data();
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  // A message beside a model is a warning: a file of ours must not have any.
  if (!model && message.find("ould not allocate ") != std::string::npos)
    throw std::bad_alloc();  // the machine's fault, not the file's
  if (!model || !message.empty()) throw ConfigError(Where(scene) + ": " + message);
  RequirePlaces(*model, Where(scene));
  return model;
}

}  // namespace turbidock::vehicle
