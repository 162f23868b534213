# Doxygen's input filter: our plain comments as its own. `//` before a declaration becomes `///`, `//`
# after one `///<`, and the comment at the top of a header is that of the file.
function escaped(text) {
  gsub(/\\/, "\\\\", text)
  gsub(/&/, "\\&amp;", text)
  gsub(/</, "\\&lt;", text)
  gsub(/>/, "\\&gt;", text)
  gsub(/@/, "\\@", text)
  gsub(/#/, "\\#", text)
  return text
}
NR == 1 && /^\/\// { print "/// @file"; print "///" }
{
  at = match($0, /\/\//)
  if (at == 0) { trailing = 0; print; next }
  code = substr($0, 1, at - 1)
  text = substr($0, at + 2)
  # Code that is shown inside a comment is indented; Doxygen takes that for what it is.
  is_code = text ~ /^ {4,}/
  if (code ~ /[^ ]/) {
    trailing = at
    print code "///<" escaped(text)
  } else if (trailing > 0 && at >= trailing - 2) {
    print code "///<" escaped(text)
  } else {
    trailing = 0
    print code "///" (is_code ? text : escaped(text))
  }
}
