#include "experiments/studies/check_vehicle/urdf.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <boost/property_tree/xml_parser.hpp>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <sstream>

#include "sim/base/check.h"
#include "sim/base/pose.h"
#include "sim/vehicle/mjcf_tags.h"
#include "sim/vehicle/model_limits.h"

namespace turbidock::check_vehicle {
namespace {

namespace fs = std::filesystem;
using boost::property_tree::ptree;
using Eigen::Matrix3d;
using Eigen::Vector3d;

std::string Attribute(const ptree& node, const std::string& path) {
  const size_t dot = path.rfind('.');
  const std::string element = dot == std::string::npos ? "" : path.substr(0, dot) + ".";
  return node.get<std::string>(element + "<xmlattr>." + path.substr(dot + 1), "");
}

std::string Text(const Vector3d& v) {
  return FormatNumber(v.x()) + " " + FormatNumber(v.y()) + " " + FormatNumber(v.z());
}

std::string Text(const Pose& X) {
  return fmt::format("pos=\"{}\" quat=\"{} {}\"", Text(X.p), FormatNumber(X.q.w()),
                     Text(Vector3d(X.q.vec())));
}

std::string Lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

// A name as an XML attribute, of what any file system and XML take.
std::string Name(std::string text) {
  for (char& c : text)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return text;
}

bool IsForMujoco(const std::string& mesh) {
  const std::string kind = Lower(fs::path(mesh).extension());
  return kind == ".stl" || kind == ".obj" || kind == ".msh";
}

struct Joint {
  std::string name, type, parent;
  Pose X_PL;                          // of its child in the parent
  Vector3d axis = Vector3d::UnitX();  // in the child
};

class Reader {
 public:
  Reader(std::string file, std::string folder)
      : file_(std::move(file)), folder_(std::move(folder)), text_(vehicle::ReadModelFile(file_)) {}

  UrdfVehicle Read() {
    Parse();
    const std::string root = Root();
    for (const auto& [link, node] : links_)
      if (link != "world") poses_[link] = PoseIn(root, link);
    SumBody();
    for (const auto& [link, joint] : joints_)
      if (joint.type != "fixed" && link != root)
        out_.held.push_back(joint.name + " (" + joint.type + ")");
    FindThrusters();
    for (const auto& [link, pose] : poses_) AddLink(link, link == root);
    Write(root);
    return out_;
  }

 private:
  // With the line of the first tag that has this attribute.
  [[noreturn]] void Fail(const std::string& tag, const std::string& key, const std::string& value,
                         const std::string& problem) const {
    int line = 1;
    for (const vehicle::Tag& t : vehicle::TagsOf(text_))
      if (t.name == tag && t.attribute(key) == value) {
        line = t.line;
        break;
      }
    throw ConfigError(
        fmt::format("{}:{}: <{} {}=\"{}\">: {}", file_, line, tag, key, value, problem));
  }

  void Parse() {
    constexpr auto kMostTags = 20000;  // they may be nested, and are read by recursion
    if (text_.find("<xacro:") != std::string::npos || text_.find("${") != std::string::npos ||
        text_.find("$(") != std::string::npos)
      throw ConfigError(fmt::format("{}: is xacro; make a URDF of it first: xacro {} > {}", file_,
                                    file_, fs::path(file_).stem().stem().string() + ".urdf"));
    if (std::ranges::count(text_, '<') > kMostTags)
      throw ConfigError(fmt::format("{}: has more than {} tags", file_, kMostTags));
    ptree xml;
    try {
      std::istringstream stream(text_);
      read_xml(stream, xml, boost::property_tree::xml_parser::no_comments);
    } catch (const boost::property_tree::xml_parser_error& error) {
      throw ConfigError(
          fmt::format("{}:{}: not valid XML: {}", file_, error.line(), error.message()));
    }
    const auto robot = xml.get_child_optional("robot");
    if (!robot) throw ConfigError(file_ + ": is no URDF: it has no <robot>");
    for (const auto& [tag, node] : *robot) {
      const std::string name = Attribute(node, "name");
      if (tag == "link" && !links_.emplace(name, node).second)
        Fail("link", "name", name, "a second link of this name");
      if (tag == "joint") AddJoint(name, node);
    }
    for (const auto& [child, joint] : joints_)
      for (const std::string& link : {child, joint.parent})
        if (!links_.contains(link))
          Fail("joint", "name", joint.name, "there is no link named \"" + link + "\"");
  }

  void AddJoint(const std::string& name, const ptree& node) {
    Joint joint{.name = name,
                .type = Attribute(node, "type"),
                .parent = Attribute(node, "parent.link"),
                .X_PL = OriginOf(node)};
    constexpr std::array kTypes = {"fixed",     "continuous", "revolute",
                                   "prismatic", "floating",   "planar"};
    if (std::ranges::find(kTypes, joint.type) == kTypes.end())
      Fail("joint", "name", name,
           fmt::format("its type must be one of {}", fmt::join(kTypes, ", ")));
    if (const std::string axis = Attribute(node, "axis.xyz"); !axis.empty())
      joint.axis = Vector("axis", "xyz", axis);
    if (!joints_.emplace(Attribute(node, "child.link"), joint).second)
      Fail("joint", "name", name, "a link has one parent, this one's child has another");
  }

  std::vector<double> Numbers(const std::string& tag, const std::string& key,
                              const std::string& text, size_t count) const {
    std::istringstream words(text);
    std::vector<double> n(std::istream_iterator<double>(words), {});
    if (n.size() != count || !words.eof() || !std::ranges::all_of(n, [](double x) {
          return std::abs(x) <= 1e4;  // as of any model
        }))
      Fail(tag, key, text, fmt::format("must be {} number{}", count, count > 1 ? "s" : ""));
    return n;
  }
  Vector3d Vector(const std::string& tag, const std::string& key, const std::string& text) const {
    return Vector3d::Map(Numbers(tag, key, text, 3).data());
  }
  double Number(const ptree& node, const std::string& tag, const std::string& key) const {
    return Numbers(tag, key, Attribute(node, tag + "." + key), 1)[0];
  }

  Pose OriginOf(const ptree& node) const {
    Pose X;
    if (const std::string p = Attribute(node, "origin.xyz"); !p.empty())
      X.p = Vector("origin", "xyz", p);
    if (const std::string rpy = Attribute(node, "origin.rpy"); !rpy.empty()) {
      const Vector3d turn = Vector("origin", "rpy", rpy);
      constexpr double kTurn_rad = 6.29;
      if (turn.cwiseAbs().maxCoeff() > kTurn_rad)
        Fail("origin", "rpy", rpy, "is more than a turn: a URDF's angles are radians");
      X.q = FromYawPitchRoll(turn.z(), turn.y(), turn.x());
    }
    return X;
  }

  // By their names: those on joints that turn for ever, else all. What only holds or watches one is
  // none. Without such names what turns for ever.
  void FindThrusters() {
    std::vector<std::string> named, turning, both;
    for (const auto& [link, joint] : joints_) {
      const std::string name = Lower(link);
      const auto is_called = [&name](const char* word) {
        return name.find(word) != std::string::npos;
      };
      constexpr std::array kThruster = {"thruster", "propeller"};
      constexpr std::array kOther = {"bracket", "mount", "guard", "sensor", "holder"};
      const bool is_named =
          std::ranges::any_of(kThruster, is_called) && std::ranges::none_of(kOther, is_called);
      const bool turns = joint.type == "continuous";
      if (is_named) named.push_back(link);
      if (turns) turning.push_back(link);
      if (is_named && turns) both.push_back(link);
    }
    out_.thrusters = !both.empty() ? both : !named.empty() ? named : turning;
  }

  // The one link that stands on none, or on a link named world, which is no part of the vehicle.
  std::string Root() const {
    std::vector<std::string> roots;
    for (const auto& [link, node] : links_) {
      const auto joint = joints_.find(link);
      if (joint == joints_.end() ? link != "world" : joint->second.parent == "world")
        roots.push_back(link);
    }
    if (roots.size() != 1)
      throw ConfigError(
          fmt::format("{}: must have one link without a parent: the vehicle; has {}{}", file_,
                      roots.empty() ? "none" : "", fmt::join(roots, ", ")));
    return roots[0];
  }

  Pose PoseIn(const std::string& root, std::string link) const {
    Pose X;
    for (size_t steps = 0; link != root; ++steps) {
      const auto joint = joints_.find(link);
      if (joint == joints_.end() || steps > links_.size())
        Fail("link", "name", link, "its parents go round in a circle");
      X = joint->second.X_PL * X;
      link = joint->second.parent;
    }
    return X;
  }

  void SumBody() {
    struct Mass {
      double kg;
      Vector3d p_BQ;
      Matrix3d I_B;
    };
    std::vector<Mass> masses;
    vehicle::RigidBodyParams& body = out_.body;
    body.mass_kg = 0;
    for (const auto& [link, X_BL] : poses_) {
      const auto inertial = links_.at(link).get_child_optional("inertial");
      if (!inertial) continue;
      const double kg = Number(*inertial, "mass", "value");
      if (kg < 0) Fail("mass", "value", Attribute(*inertial, "mass.value"), "must be >= 0");
      const auto I = [&](const char* key) { return Number(*inertial, "inertia", key); };
      // Read before the matrix is begun: what throws must not leave it half filled.
      const Vector3d own(I("ixx"), I("iyy"), I("izz")), products(I("ixy"), I("ixz"), I("iyz"));
      Matrix3d I_L = own.asDiagonal();
      I_L(0, 1) = I_L(1, 0) = products.x();
      I_L(0, 2) = I_L(2, 0) = products.y();
      I_L(1, 2) = I_L(2, 1) = products.z();
      const Pose X_BQ = X_BL * OriginOf(*inertial);
      const Matrix3d R = X_BQ.q.toRotationMatrix();
      masses.push_back({kg, X_BQ.p, R * I_L * R.transpose()});
      body.mass_kg += kg;
      out_.links += kg > 0;
    }
    if (!(body.mass_kg > 0)) throw ConfigError(file_ + ": no link has an <inertial> with a <mass>");
    for (const Mass& m : masses) body.p_BBcm_m += m.kg / body.mass_kg * m.p_BQ;
    Matrix3d sum = Matrix3d::Zero();
    for (const Mass& m : masses) {
      const Vector3d r = m.p_BQ - body.p_BBcm_m;
      sum += m.I_B + m.kg * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
    }
    const auto tidy = [](double x) { return std::round(x * 1e9) / 1e9 + 0.0; };  // of sums
    body.mass_kg = tidy(body.mass_kg);
    body.p_BBcm_m = body.p_BBcm_m.unaryExpr(tidy);
    body.inertia_kg_m2 = sum.diagonal().unaryExpr(tidy);
    body.inertia_products_kg_m2 = Vector3d(sum(0, 1), sum(0, 2), sum(1, 2)).unaryExpr(tidy);
    try {
      CheckFields(body, "");
    } catch (const ConfigError& error) {
      throw ConfigError(file_ + ": the sum of its links: " + error.what());
    }
  }

  // From its own folder; of package://NAME/PATH from there or a folder above, with or without NAME.
  std::string FindMesh(const std::string& named) const {
    if (!IsForMujoco(named))
      Fail("mesh", "filename", named,
           "MuJoCo reads .stl, .obj and .msh: convert it, as by `assimp export IN OUT.stl`");
    const size_t scheme = named.find("://");
    const bool is_package = named.starts_with("package://") || named.starts_with("model://");
    const fs::path path = scheme == std::string::npos ? named : named.substr(scheme + 3);
    const fs::path in_package = is_package ? path.lexically_relative(*path.begin()) : path;
    std::error_code ignored;
    const fs::path start = fs::absolute(file_).parent_path();
    for (fs::path above = start;; above = above.parent_path()) {
      for (const fs::path& found : {above / path, above / in_package})
        if (fs::is_regular_file(found, ignored))
          return fs::relative(found, fs::absolute(folder_), ignored);
      if (!is_package || above == above.parent_path()) break;
    }
    Fail("mesh", "filename", named,
         "no such file in " + start.string() + (is_package ? " or a folder above" : ""));
  }

  // Type and size of a <geometry>.
  std::string Shape(const ptree& geometry, const std::string& link) {
    const auto number = [&](const std::string& tag, const std::string& key) {
      return Number(geometry, tag, key);
    };
    if (geometry.get_child_optional("box"))
      return "type=\"box\" size=\"" +
             Text(Vector3d(Vector("box", "size", Attribute(geometry, "box.size")) / 2)) + "\"";
    if (geometry.get_child_optional("sphere"))
      return "type=\"sphere\" size=\"" + FormatNumber(number("sphere", "radius")) + "\"";
    for (const std::string round : {"cylinder", "capsule"})
      if (geometry.get_child_optional(round))
        return "type=\"" + round + "\" size=\"" + FormatNumber(number(round, "radius")) + " " +
               FormatNumber(number(round, "length") / 2) + "\"";
    const std::string named = Attribute(geometry, "mesh.filename");
    if (named.empty()) Fail("link", "name", link, "has a <geometry> that is none of URDF's");
    const std::string scale = Attribute(geometry, "mesh.scale");
    const std::string mesh = fmt::format("mesh_{}", ++meshes_);
    const std::string file = FindMesh(named);
    if (files_.emplace(fs::path(file).filename(), file).first->second != file)
      Fail("mesh", "filename", named, "another mesh in another folder has this name: rename it");
    assets_ +=
        fmt::format("    <mesh name=\"{}\" file=\"{}\"{}/>\n", mesh, file,
                    scale.empty() ? "" : " scale=\"" + Text(Vector("mesh", "scale", scale)) + "\"");
    return "type=\"mesh\" mesh=\"" + mesh + "\"";
  }

  // Its shapes and a site. What it collides with is drawn where it has nothing else to be seen.
  void AddLink(const std::string& link, bool is_root) {
    ptree node = links_.at(link);
    const Pose& X_BL = poses_.at(link);
    const bool touches = node.count("collision") > 0;
    for (auto shape = node.begin(); shape != node.end();) {
      const std::string mesh = Attribute(shape->second, "geometry.mesh.filename");
      const bool is_left_out = shape->first == "visual" && !mesh.empty() && !IsForMujoco(mesh);
      if (is_left_out)
        out_.not_drawn.push_back(fmt::format("{} of {}{}", fs::path(mesh).filename().string(), link,
                                             touches ? "" : ", which has no <collision> either"));
      shape = is_left_out ? node.erase(shape) : std::next(shape);
    }
    const bool seen = node.count("visual") > 0;
    const ptree none;
    bool is_pole = link == "pole";
    int number = 0;
    Eigen::Quaterniond along = Eigen::Quaterniond::Identity();
    for (const char* kind : {"collision", "visual"})
      for (const auto& [tag, shape] : node) {
        if (tag != kind) continue;
        const bool solid = tag == "collision" || !touches;
        const Pose X_LG = OriginOf(shape);
        const std::string name = is_pole ? "pole" : fmt::format("hull_{}_{}", Name(link), ++number);
        const ptree& geometry = shape.get_child("geometry", none);
        std::string color = Attribute(shape, "material.color.rgba");
        if (!color.empty())
          color = fmt::format(" rgba=\"{}\"", fmt::join(Numbers("color", "rgba", color, 4), " "));
        if (geometry.get_child_optional("cylinder"))
          along = X_LG.q * Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), Vector3d::UnitZ());
        geoms_ += fmt::format("      <geom name=\"{}\"{} {} {}{}{}/>\n", name,
                              !solid    ? ""
                              : is_pole ? " class=\"docking\""
                                        : " class=\"solid\"",
                              Shape(geometry, link), Text(X_BL * X_LG), color,
                              solid && seen && touches ? " group=\"3\"" : "");
        is_pole = false;
      }
    if (is_root) return;
    Pose X_BS = X_BL;
    const Joint& joint = joints_.at(link);
    if (joint.type != "fixed")
      X_BS.q = X_BL.q * Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), joint.axis);
    else if (std::ranges::count(out_.thrusters, link) > 0)
      X_BS.q = X_BL.q * along;
    sites_ += fmt::format("      <site name=\"{}\" {}/>\n", Name(link), Text(X_BS));
    if (link == "camera_head")  // the rig's data say where in it
      for (const char* side : {"left", "right"})
        sites_ += fmt::format("      <camera name=\"{}\" {}/>\n", side, Text(X_BL));
  }

  void Write(const std::string& root) {
    std::string motors;
    for (const std::string& link : out_.thrusters)
      motors += fmt::format("    <motor name=\"{0}\" site=\"{0}\"/>\n", Name(link));
    const vehicle::RigidBodyParams& body = out_.body;
    const Vector3d& products = body.inertia_products_kg_m2;
    out_.mjcf = fmt::format(
        "<mujoco>\n  <!-- {}, by turbidock check-vehicle --mjcf. B is the frame of {}. -->\n"
        "  <asset>\n{}  </asset>\n  <worldbody>\n"
        "    <body name=\"vehicle\" pos=\"-1.5 0 -0.8\">\n      <freejoint name=\"vehicle\"/>\n"
        "      <inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{} {}\"/>\n{}{}"
        "    </body>\n  </worldbody>\n  <actuator>\n{}  </actuator>\n</mujoco>\n",
        Name(fs::path(file_).stem()), Name(root), assets_, Text(body.p_BBcm_m),
        FormatNumber(body.mass_kg), Text(body.inertia_kg_m2), Text(products), sites_, geoms_,
        motors);
  }

  const std::string file_, folder_, text_;
  std::map<std::string, ptree> links_;
  std::map<std::string, Joint> joints_;  // by their children
  std::map<std::string, Pose> poses_;    // of the vehicle's links in B
  int meshes_ = 0;
  std::map<std::string, std::string> files_;  // of meshes, by their names alone
  std::string assets_, sites_, geoms_;
  UrdfVehicle out_;
};

}  // namespace

bool IsUrdf(const std::string& file) {
  const std::string name = Lower(file);
  if (name.ends_with(".urdf") || name.ends_with(".xacro")) return true;
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  const std::vector<vehicle::Tag> tags = vehicle::TagsOf(vehicle::ReadModelFile(file));
  return std::ranges::find(tags, "robot", &vehicle::Tag::name) != tags.end();
}

UrdfVehicle ReadUrdf(const std::string& file, const std::string& folder) {
  return Reader(file, folder).Read();
}

}  // namespace turbidock::check_vehicle
