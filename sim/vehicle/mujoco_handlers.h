#pragma once
// MuJoCo's words. By default it writes warnings and errors to MUJOCO_LOG.TXT in the working
// directory.

namespace turbidock::vehicle {

// Makes MuJoCo leave the working directory alone: a warning is only counted (in mjData, where the
// plant looks after every step), an error is printed on stderr and ends the program with exit code
// 4. Process-wide, as MuJoCo's hooks are; calling it again changes nothing. LoadScene does.
void InstallMujocoHandlers();

// While it lives, an error of MuJoCo's is thrown as a std::runtime_error instead: for reading
// files, in which a name or a number can be one. What MuJoCo held by then is never freed.
class ThrowingMujocoErrors {
 public:
  ThrowingMujocoErrors();
  ~ThrowingMujocoErrors();
  ThrowingMujocoErrors(const ThrowingMujocoErrors&) = delete;
  ThrowingMujocoErrors& operator=(const ThrowingMujocoErrors&) = delete;
};

}  // namespace turbidock::vehicle
