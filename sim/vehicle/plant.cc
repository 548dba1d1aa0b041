#include "sim/vehicle/plant.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace turbidock::vehicle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using RowMajor3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Nothing in this simulation moves at this speed: the integration has diverged.
constexpr double kMaxSpeed = 1e3;  // m/s or rad/s

Vector3d At3(const mjtNum* values, int index) { return Vector3d::Map(values + 3 * index); }

Matrix3d RotationAt(const mjtNum* values, int index) { return RowMajor3d::Map(values + 9 * index); }

Wrench operator+(const Wrench& a, const Wrench& b) { return {a.tau + b.tau, a.f + b.f}; }

// Power of a wrench on a body that moves with V, both at B's origin and in B.
double Dot(const Wrench& F, const Twist& V) { return F.tau.dot(V.w) + F.f.dot(V.v); }

std::string GeomName(const mjModel& m, int geom) {
  const char* name = mj_id2name(&m, mjOBJ_GEOM, geom);
  return name ? name : "geom " + std::to_string(geom);
}

}  // namespace

Plant::Plant(const Scene& scene, const VehicleParams& params, const ClockParams& clock,
             const Sea& sea, const Mooring& mooring)
    : scene_(scene),
      clock_(clock),
      body_(params.LoadedRigidBody()),
      hydro_(params.LoadedHydrodynamics()),
      total_mass_(RigidBodyInertia(body_) + hydro_.added_mass),
      initial_sea_(sea),
      sea_(sea),
      initial_mooring_(mooring),
      mooring_(mooring),
      thrusters_(params.thrusters.Of(NamesOf(scene.thrusters), "vehicle.thrusters"),
                 params.thrusters.Effectiveness(scene.thrusters.size())) {
  CheckFields(params, "vehicle");
  CheckFields(clock, "trial.clock");
  TD_CHECK(scene.model && scene.vehicle_body > 0, "the scene has no vehicle");
  CheckModel();
  CheckMooredBody();

  model_.reset(mj_copyModel(nullptr, scene.model.get()));
  data_.reset(mj_makeData(model_.get()));
  const int joint = model_->body_jntadr[scene.vehicle_body];
  qpos_adr_ = model_->jnt_qposadr[joint];
  dof_adr_ = model_->jnt_dofadr[joint];
  model_->opt.timestep = clock.dt_s();
  model_->opt.integrator = mjINT_EULER;
  OverwriteRigidBody();
  WeighConstraints();
  HoldMooredBody();
  OverwriteContacts(params.contact);
  Reset({Eigen::Quaterniond(Eigen::Vector4d::Map(model_->qpos0 + qpos_adr_ + 3)({1, 2, 3, 0})),
         Vector3d::Map(model_->qpos0 + qpos_adr_)});
}

void Plant::CheckModel() const {
  const mjModel& m = *scene_.model;
  const int joint = m.body_jntadr[scene_.vehicle_body];
  if (m.body_jntnum[scene_.vehicle_body] != 1 || m.jnt_type[joint] != mjJNT_FREE)
    throw ConfigError("the MJCF's vehicle must have a free joint and no other");
  if (m.opt.density != 0 || m.opt.viscosity != 0)
    throw ConfigError("the MJCF's option density and viscosity must be 0: the water is ours");
  for (int i = 0; i < 6; ++i) {
    // Either would be a second, unphysical damping or added mass; damping would also make the
    // integrator use another inertia matrix.
    const int dof = m.jnt_dofadr[joint] + i;
    if (m.dof_damping[dof] != 0 || m.dof_armature[dof] != 0 || m.dof_frictionloss[dof] != 0)
      throw ConfigError("the vehicle's free joint must have no damping, armature or frictionloss");
  }
  for (const ThrusterInScene& thruster : scene_.thrusters) {
    const int a = thruster.actuator;
    const Vector3d axis = Vector3d::Map(m.actuator_gear + 6 * a);
    const bool unit_force =
        std::abs(axis.norm() - 1) < 1e-9 && Vector3d::Map(m.actuator_gear + 6 * a + 3).isZero() &&
        m.actuator_gaintype[a] == mjGAIN_FIXED && m.actuator_gainprm[mjNGAIN * a] == 1 &&
        m.actuator_biastype[a] == mjBIAS_NONE && !m.actuator_forcelimited[a] &&
        !m.actuator_ctrllimited[a];
    if (m.actuator_trntype[a] != mjTRN_SITE || !unit_force)
      throw ConfigError("thruster " + thruster.name +
                        " must be a motor at a site with a gear of length 1 and no limits: the "
                        "limits are the thruster's data");
  }
}

void Plant::CheckMooredBody() const {
  const MooringParams& params = initial_mooring_.params();
  const auto require = [](bool moves, int joint, const char* key, const char* name) {
    if (moves && joint < 0)
      throw ConfigError(std::string("station.mooring.") + key,
                        "needs a scene whose station stands on a joint " + std::string(name) +
                            ", such as sea_moored_active.xml");
  };
  const auto [x, y, yaw] = scene_.moored_body.joints;
  require(params.swing_x_m > 0, x, "swing_x_m", "mooring_x");
  require(params.swing_y_m > 0, y, "swing_y_m", "mooring_y");
  require(params.drawn(), x, "natural_period_s", "mooring_x");
  require(params.drawn(), y, "natural_period_s", "mooring_y");
  require(params.turns(), yaw, "weathervane_arm_m", "mooring_yaw");
}

// Nothing that touches the station moves it: contacts feel it as they feel the world, but for its
// velocity.
void Plant::HoldMooredBody() {
  constexpr double kHeavy = 1e9;  // kg, kg m^2
  mjModel& m = *model_;
  if (scene_.moored_body.body < 0) return;
  for (int b = 0; b < m.nbody; ++b)
    if (m.body_weldid[b] == scene_.moored_body.body)
      m.body_invweight0[2 * b] = m.body_invweight0[2 * b + 1] = 0;
  for (const int joint : scene_.moored_body.joints) {
    if (joint < 0) continue;
    m.dof_armature[m.jnt_dofadr[joint]] = kHeavy;
    m.dof_invweight0[m.jnt_dofadr[joint]] = 0;
  }
}

// Gives the station the velocity that takes it where the mooring has it at the end of the tick.
void Plant::MoveMooredBody() {
  if (scene_.moored_body.body < 0) return;
  mooring_.Step(sea_, time_s(), clock_.dt_s());
  for (int axis = 0; axis < 3; ++axis) {
    const int joint = scene_.moored_body.joints[axis];
    if (joint < 0) continue;
    const double now = data_->qpos[model_->jnt_qposadr[joint]];
    data_->qvel[model_->jnt_dofadr[joint]] = (mooring_.displacement()[axis] - now) / clock_.dt_s();
  }
}

void Plant::OverwriteRigidBody() {
  mjModel& m = *model_;
  const int vehicle = scene_.vehicle_body;
  for (int b = 0; b < m.nbody; ++b) {
    if (m.body_weldid[b] != vehicle) continue;
    // The parameters are the mass of everything rigidly fixed to the vehicle.
    m.body_mass[b] = 0;
    Vector3d::Map(m.body_inertia + 3 * b).setZero();
  }
  Eigen::SelfAdjointEigenSolver<Matrix3d> principal(body_.Inertia());
  Matrix3d R_BP = principal.eigenvectors();
  if (R_BP.determinant() < 0) R_BP.col(2) *= -1;
  const Eigen::Quaterniond q_BP(R_BP);
  m.body_mass[vehicle] = body_.mass_kg;
  Vector3d::Map(m.body_inertia + 3 * vehicle) = principal.eigenvalues();
  Vector3d::Map(m.body_ipos + 3 * vehicle) = body_.p_BBcm_m;
  Eigen::Vector4d::Map(m.body_iquat + 4 * vehicle) << q_BP.w(), q_BP.x(), q_BP.y(), q_BP.z();

  // Short cuts that the compiler took for the nominal inertia: a "simple" body's row of the inertia
  // matrix is treated as diagonal and would swallow the added mass; frames noted as equal no longer
  // are.
  m.body_simple[vehicle] = 0;
  for (int i = 0; i < 6; ++i) m.dof_simplenum[dof_adr_ + i] = 0;
  m.body_sameframe[vehicle] = 0;
  constexpr mjtByte kSameAsInertialFrame = 2;
  for (int g = 0; g < m.ngeom; ++g)
    if (m.geom_bodyid[g] == vehicle && m.geom_sameframe[g] == kSameAsInertialFrame)
      m.geom_sameframe[g] = 0;
  for (int s = 0; s < m.nsite; ++s)
    if (m.site_bodyid[s] == vehicle && m.site_sameframe[s] == kSameAsInertialFrame)
      m.site_sameframe[s] = 0;

  // Derived masses follow; the scene's extent, which rendering scales its depth range with, stays.
  const auto stat = m.stat;
  mj_setConst(&m, data_.get());
  const double meaninertia = m.stat.meaninertia;
  m.stat = stat;
  m.stat.meaninertia = meaninertia;
}

void Plant::WeighConstraints() {
  // MuJoCo scales a contact's softness by the bodies' inverse weights, which must know of the added
  // mass.
  const Matrix6d inverse = total_mass_.inverse();
  Eigen::Matrix<double, 3, 6> jacobian;  // velocity of the centre of mass
  const Vector3d& p = body_.p_BBcm_m;
  jacobian << 1, 0, 0, 0, p.z(), -p.y(),  //
      0, 1, 0, -p.z(), 0, p.x(),          //
      0, 0, 1, p.y(), -p.x(), 0;
  const double linear = (jacobian * inverse * jacobian.transpose()).trace() / 3;
  const double angular = inverse.bottomRightCorner<3, 3>().trace() / 3;
  for (int b = 0; b < model_->nbody; ++b) {
    if (model_->body_weldid[b] != scene_.vehicle_body) continue;
    model_->body_invweight0[2 * b] = linear;
    model_->body_invweight0[2 * b + 1] = angular;
  }
}

void Plant::OverwriteContacts(const ContactParams& contact) {
  // MuJoCo's solref: a damping time constant, which is that of the spring over the damping ratio,
  // and the damping ratio. It would lengthen what the step is too coarse for.
  const double damping_ratio = contact.DampingRatio();
  const double damping_time_s = contact.time_constant_s / damping_ratio;
  if (damping_time_s < 2 * clock_.dt_s())
    throw ConfigError("vehicle.contact.time_constant_s",
                      FormatNumber(contact.time_constant_s) + " must be at least " +
                          FormatNumber(2 * clock_.dt_s() * damping_ratio) +
                          " at this restitution and physics step");
  for (int g = 0; g < model_->ngeom; ++g) {
    if (scene_.geom_part[g] != Part::kPole && scene_.geom_part[g] != Part::kDock) continue;
    model_->geom_friction[3 * g] = contact.friction;
    model_->geom_solref[mjNREF * g] = damping_time_s;
    model_->geom_solref[mjNREF * g + 1] = damping_ratio;
  }
}

void Plant::Reset(const Pose& X_WB, int64_t tick) {
  mj_resetData(model_.get(), data_.get());
  sea_ = initial_sea_;
  mooring_ = initial_mooring_;
  if (scene_.moored_body.body >= 0) {
    mooring_.Reset(sea_, At3(model_->body_pos, scene_.moored_body.body));
    for (int axis = 0; axis < 3; ++axis)
      if (const int joint = scene_.moored_body.joints[axis]; joint >= 0)
        data_->qpos[model_->jnt_qposadr[joint]] = mooring_.displacement()[axis];
  }
  thrusters_.Reset();
  tick_ = tick;
  extra_F_B_ = {};
  dock_force_newton_ = collision_force_newton_ = 0;
  collision_geom_a_ = collision_geom_b_ = -1;
  MoveTo(X_WB);
}

void Plant::MoveTo(const Pose& X_WB) {
  mjtNum* qpos = data_->qpos + qpos_adr_;
  Vector3d::Map(qpos) = X_WB.p;
  const Eigen::Quaterniond q = X_WB.q.normalized();
  Eigen::Vector4d::Map(qpos + 3) << q.w(), q.x(), q.y(), q.z();
  Vector6d::Map(data_->qvel + dof_adr_).setZero();
  UpdatePositions();
  StartEnergyBalance();
}

void Plant::SetVelocity(const Twist& V_WB_B) {
  mjtNum* qvel = data_->qvel + dof_adr_;
  Vector3d::Map(qvel) = RotationAt(data_->xmat, scene_.vehicle_body) * V_WB_B.v;
  Vector3d::Map(qvel + 3) = V_WB_B.w;
  StartEnergyBalance();
}

void Plant::StartEnergyBalance() {
  work_ = {};
  kinetic_start_joule_ = KineticEnergy();
  potential_start_joule_ = PotentialEnergy();
}

// The stages of mj_fwdPosition in their order, with the added mass put in before the factorisation.
void Plant::UpdatePositions() {
  const mjModel* m = model_.get();
  mjData* d = data_.get();
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_camlight(m, d);
  mj_tendon(m, d);
  mj_crb(m, d);
  AddAddedMass();
  mj_factorM(m, d);
  mj_collision(m, d);
  mj_makeConstraint(m, d);
  mj_transmission(m, d);
  mj_projectConstraint(m, d);
}

void Plant::AddAddedMass() {
  // The joint's velocity is (linear in W, angular in B): only the linear rows and columns turn.
  const Matrix3d R_WB = RotationAt(data_->xmat, scene_.vehicle_body);
  const Matrix6d& A = hydro_.added_mass;
  Matrix6d turned;
  turned.topLeftCorner<3, 3>() = R_WB * A.topLeftCorner<3, 3>() * R_WB.transpose();
  turned.bottomLeftCorner<3, 3>() = A.bottomLeftCorner<3, 3>() * R_WB.transpose();
  turned.bottomRightCorner<3, 3>() = A.bottomRightCorner<3, 3>();
  // A row of MuJoCo's sparse matrix runs from the diagonal towards the root of the tree.
  for (int i = 0; i < 6; ++i) {
    mjtNum* row = data_->qM + model_->dof_Madr[dof_adr_ + i];
    for (int j = i; j >= 0; --j) row[i - j] += turned(i, j);
  }
}

BodyInWater Plant::CurrentBody(const WaterMotion& water) const {
  const VehicleTruth now = truth();
  return {.X_WB = now.X_WB,
          .V_WB_B = now.V_WB_B,
          .water_v_W = water.v_W,
          .water_a_W = water.a_W,
          .gravity_W = Vector3d::Map(model_->opt.gravity)};
}

PerThruster Plant::ThrusterInflow(const Vector3d& water_v_W) const {
  PerThruster inflow_mps;
  const Vector3d v_WB = Vector3d::Map(data_->qvel + dof_adr_);
  const Vector3d w_W =
      RotationAt(data_->xmat, scene_.vehicle_body) * Vector3d::Map(data_->qvel + dof_adr_ + 3);
  const Vector3d p_WB = At3(data_->xpos, scene_.vehicle_body);
  for (const ThrusterInScene& thruster : scene_.thrusters) {
    const int actuator = thruster.actuator;
    const int site = model_->actuator_trnid[2 * actuator];
    const Vector3d axis_W =
        RotationAt(data_->site_xmat, site) * Vector3d::Map(model_->actuator_gear + 6 * actuator);
    const Vector3d v_site_W = v_WB + w_W.cross(At3(data_->site_xpos, site) - p_WB);
    inflow_mps.push_back(axis_W.dot(v_site_W - water_v_W));
  }
  return inflow_mps;
}

std::optional<std::string> Plant::Step(const ThrusterCommand& command) {
  for (const double volts : command.volts)
    if (!std::isfinite(volts)) return "a thruster command is not finite";
  const mjModel* m = model_.get();
  mjData* d = data_.get();
  const double dt_s = clock_.dt_s();

  // what the water does at this instant
  sea_.Step(dt_s, time_s());
  const WaterMotion water_now = water();
  const BodyInWater body = CurrentBody(water_now);
  const HydroWrenches hydro = ComputeHydroWrenches(hydro_, body);
  Wrench tether_F_B;
  if (sea_.tether().enabled) {
    const Vector3d& p_BQ = sea_.tether().p_BQ_m;
    const Vector3d v_WQ = body.X_WB.q * (body.V_WB_B.v + body.V_WB_B.w.cross(p_BQ));
    tether_F_B.f = body.X_WB.q.conjugate() * sea_.TetherForce(body.X_WB * p_BQ, v_WQ, time_s());
    tether_F_B.tau = p_BQ.cross(tether_F_B.f);
  }

  MoveMooredBody();

  // all forces into MuJoCo
  const Wrench F_B = hydro.damping + hydro.buoyancy + hydro.inertial + tether_F_B + extra_F_B_;
  mjtNum* applied = d->qfrc_applied + dof_adr_;
  Vector3d::Map(applied) = RotationAt(d->xmat, scene_.vehicle_body) * F_B.f;
  Vector3d::Map(applied + 3) = F_B.tau;
  const ThrusterForces& thrust_newton = thrusters_.Step(
      command, ThrusterInflow(water_now.v_W), dt_s,
      thruster_faults_.empty() ? ThrusterFactors{}
                               : FactorsAt(thruster_faults_, scene_.thrusters.size(), time_s()));
  for (size_t i = 0; i < scene_.thrusters.size(); ++i)
    d->ctrl[scene_.thrusters[i].actuator] = thrust_newton[i];

  // the rest of MuJoCo's step, from the positions that the last one left
  mj_fwdVelocity(m, d);
  mj_fwdActuation(m, d);
  mj_fwdAcceleration(m, d);
  mj_fwdConstraint(m, d);
  SumContacts();
  mj_Euler(m, d);
  ++tick_;
  d->time = time_s();
  AddWork(body.V_WB_B, hydro, tether_F_B, water_now.v_W);

  // A broken state is not worth the collision stage, which may not survive it.
  if (auto fault = Fault()) return fault;
  UpdatePositions();
  return Fault();
}

void Plant::SumContacts() {
  dock_force_newton_ = collision_force_newton_ = 0;
  collision_geom_a_ = collision_geom_b_ = -1;
  double strongest_newton = 0;
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    const auto is_vehicle = [&](int geom) {
      return model_->body_weldid[model_->geom_bodyid[geom]] == scene_.vehicle_body;
    };
    int ours = contact.geom1, other = contact.geom2;
    if (!is_vehicle(ours)) std::swap(ours, other);
    if (!is_vehicle(ours)) continue;
    mjtNum wrench[6];
    mj_contactForce(model_.get(), data_.get(), i, wrench);
    const double force_newton = Vector3d::Map(wrench).norm();
    if (scene_.geom_part[ours] == Part::kPole && scene_.geom_part[other] == Part::kDock) {
      dock_force_newton_ += force_newton;
      continue;
    }
    collision_force_newton_ += force_newton;
    if (force_newton > strongest_newton) {
      strongest_newton = force_newton;
      collision_geom_a_ = ours;
      collision_geom_b_ = other;
    }
  }
}

void Plant::AddWork(const Twist& V_before, const HydroWrenches& hydro, const Wrench& tether_F_B,
                    const Vector3d& water_v_W) {
  // A force constant over the tick works along the mean of the velocities at its ends, in the axes
  // of its beginning: then the change of kinetic energy under a constant inertia is met exactly.
  const double dt_s = clock_.dt_s();
  const Matrix3d R_WB = RotationAt(data_->xmat, scene_.vehicle_body);  // still of the beginning
  const mjtNum* qvel = data_->qvel + dof_adr_;
  const Twist V{.w = 0.5 * (V_before.w + Vector3d::Map(qvel + 3)),
                .v = 0.5 * (V_before.v + R_WB.transpose() * Vector3d::Map(qvel))};
  const auto joint_work = [&](const mjtNum* qfrc) {
    const Wrench F_B{.tau = Vector3d::Map(qfrc + dof_adr_ + 3),
                     .f = R_WB.transpose() * Vector3d::Map(qfrc + dof_adr_)};
    return dt_s * Dot(F_B, V);
  };
  const Twist water{.w = Vector3d::Zero(), .v = R_WB.transpose() * water_v_W};
  const double water_power_by_drag = Dot(hydro.damping, water);
  work_.thruster_work += joint_work(data_->qfrc_actuator);
  work_.contact_work += joint_work(data_->qfrc_constraint);
  work_.extra_work += dt_s * Dot(extra_F_B_, V);
  work_.tether_work += dt_s * Dot(tether_F_B, V);
  work_.drag_loss += dt_s * (water_power_by_drag - Dot(hydro.damping, V));
  work_.water_work += dt_s * (water_power_by_drag + Dot(hydro.inertial, V) - Dot(hydro.frame, V));
}

double Plant::KineticEnergy() const {
  const Twist V = truth().V_WB_B;
  Vector6d v;
  v << V.v, V.w;
  return 0.5 * v.dot(total_mass_ * v);
}

double Plant::PotentialEnergy() const {
  const Pose X_WB = truth().X_WB;
  const double gravity_mps2 = -model_->opt.gravity[2];
  return body_.mass_kg * gravity_mps2 * (X_WB * body_.p_BBcm_m).z() +
         BuoyancyPotential(hydro_, X_WB, gravity_mps2);
}

std::optional<std::string> Plant::Fault() const {
  const auto sound = [](const mjtNum* values, int count, double limit) {
    return std::all_of(values, values + count,
                       [&](double x) { return std::abs(x) <= limit; });  // false for NaN
  };
  if (!sound(data_->qpos, model_->nq, mjMAXVAL)) return "a position is not finite";
  if (!sound(data_->qvel, model_->nv, kMaxSpeed)) return "the velocity has diverged";
  for (int i = 0; i < mjNWARNING; ++i)
    if (data_->warning[i].number > 0)
      return std::string("MuJoCo: ") + mju_warningText(i, data_->warning[i].lastinfo);
  return std::nullopt;
}

VehicleTruth Plant::truth() const {
  const mjtNum* qpos = data_->qpos + qpos_adr_;
  const mjtNum* qvel = data_->qvel + dof_adr_;
  VehicleTruth truth;
  truth.tick = tick_;
  truth.X_WB = {Eigen::Quaterniond(qpos[3], qpos[4], qpos[5], qpos[6]), Vector3d::Map(qpos)};
  truth.V_WB_B = {.w = Vector3d::Map(qvel + 3),
                  .v = truth.X_WB.q.conjugate() * Vector3d::Map(qvel)};
  truth.thrust_newton = thrusters_.thrust_newton();
  return truth;
}

WaterMotion Plant::water() const { return sea_.At(truth().X_WB * hydro_.p_BBcb, time_s()); }

ContactReport Plant::contacts() const {
  ContactReport report{.dock_force_newton = dock_force_newton_,
                       .collision_force_newton = collision_force_newton_,
                       .collision = ""};
  if (collision_geom_a_ >= 0)
    report.collision =
        GeomName(*model_, collision_geom_a_) + " against " + GeomName(*model_, collision_geom_b_);
  return report;
}

PoleInDock Plant::pole() const {
  PoleInDock pole;
  if (scene_.pole_tip_site < 0 || scene_.dock_mouth_site < 0) return pole;
  const Matrix3d R_WD = RotationAt(data_->site_xmat, scene_.dock_mouth_site);
  pole.p_DQ = R_WD.transpose() * (At3(data_->site_xpos, scene_.pole_tip_site) -
                                  At3(data_->site_xpos, scene_.dock_mouth_site));
  pole.insertion_depth_m = pole.p_DQ.x();
  const double half_m = scene_.dock_throat_half_width_m;
  pole.inserted = pole.p_DQ.x() > scene_.dock_throat_depth_m && std::abs(pole.p_DQ.y()) < half_m &&
                  std::abs(pole.p_DQ.z()) < half_m;
  return pole;
}

EnergyBalance Plant::energy() const {
  EnergyBalance balance = work_;
  balance.kinetic_change = KineticEnergy() - kinetic_start_joule_;
  balance.potential_change = PotentialEnergy() - potential_start_joule_;
  return balance;
}

}  // namespace turbidock::vehicle
