// What came of a call: a code for programs, a sentence for people.
#ifndef CIRCLINE_ESTIMATORS_STATUS_H_
#define CIRCLINE_ESTIMATORS_STATUS_H_

#include <string>
#include <utility>

#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// What came of a call.
enum class StatusCode {
  kOk,
  kRefused,  // The evidence does not determine the answer: something is missing or degenerate.
  kFailed,   // The evidence should have sufficed, but the numerics did not get there.
  kInvalidArgument,  // The input itself is wrong (an option out of range, a camera without focal
                     // length).
};

// "ok", "refused", "failed", "invalid".
const char* StatusCodeName(StatusCode code);

// A code and its reason in words.
struct Status {
  StatusCode code = StatusCode::kOk;  // For programs.
  std::string
      message;  // One sentence that names the thing (which circle, which field); empty if ok.

  // Whether there is an answer.
  bool ok() const { return code == StatusCode::kOk; }

  // A status of each kind, with its sentence.
  static Status Ok() { return {}; }
  static Status Refused(std::string message) { return {StatusCode::kRefused, std::move(message)}; }
  static Status Failed(std::string message) { return {StatusCode::kFailed, std::move(message)}; }
  static Status Invalid(std::string message) {
    return {StatusCode::kInvalidArgument, std::move(message)};
  }
};

inline const char* StatusCodeName(StatusCode code) {
  switch (code) {
    case StatusCode::kOk:
      return "ok";
    case StatusCode::kRefused:
      return "refused";
    case StatusCode::kFailed:
      return "failed";
    case StatusCode::kInvalidArgument:
      return "invalid";
  }
  return "unknown";
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_STATUS_H_
