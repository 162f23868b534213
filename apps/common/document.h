// YAML, JSON and OpenCV's XML as values of nlohmann's library, of any bytes that somebody may
// bring: time and memory grow with the text's length, its depth is bounded, nothing crashes or
// hangs.
#ifndef CIRCLINE_APPS_COMMON_DOCUMENT_H_
#define CIRCLINE_APPS_COMMON_DOCUMENT_H_

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "circline/estimators/status.h"

namespace circline::apps {

// What a document of ours may have; each is named in the sentence that refuses more.
struct DocumentLimits {
  int depth = 32;                    // Of lists and maps in each other; a scene has 8.
  std::size_t keys_of_a_map = 1000;  // An image has 10.
};

// YAML, with or without OpenCV's "%YAML:1.0" header; JSON where the text begins with a brace; XML
// of OpenCV's FileStorage where it begins with "<". A plain scalar that is a number becomes one,
// every other scalar is text. Not ok: one sentence with the line, also for a key that stands twice
// in a map, an alias, and a second document.
Status ParseDocument(const std::string& text, nlohmann::ordered_json* root,
                     const DocumentLimits& limits = {});

// The entries of a matrix, row by row; null for what is not finite.
nlohmann::ordered_json JsonNumbers(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

// JSON on one line; what is not UTF-8 is replaced, so that a file name cannot stop a run.
std::string JsonText(const nlohmann::ordered_json& json);

// JSON for people to read and to change, which is YAML, too: the parts of lists and maps have lines
// of their own down to `depth`, numbers stand side by side.
std::string DocumentText(const nlohmann::ordered_json& root, int depth = 5);

// A text as JsonText has it: what is not UTF-8 is replaced.
std::string TextAsWritten(const std::string& text);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_DOCUMENT_H_
