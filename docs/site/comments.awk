# Doxygen's input filter: our plain comments as its own. `//` before a declaration becomes `///`, `//`
# after one `///<`, and the comment at the top of a header is that of the file. A comment is that of
# all declarations that follow it without another one, up to an empty line, and of all names of one.
function escaped(text) {
  gsub(/\\/, "\\\\", text)
  gsub(/&/, "\\&amp;", text)
  gsub(/</, "\\&lt;", text)
  gsub(/>/, "\\&gt;", text)
  gsub(/@/, "\\@", text)
  gsub(/#/, "\\#", text)
  return text
}
# "double x = 0.0, y = 0.0;" one by one, each with the comment above or `after` it.
function print_names(code, after, type, names, count, i) {
  if (starts && match(code, /^ *(std::[a-z]+<[^;=]*>|[A-Za-z_:0-9]+) [a-z_0-9]+( = [^,;]*)?,/) && code ~ /; *$/) {
    match(code, /^ *(std::[a-z]+<[^;=]*>|[A-Za-z_:0-9]+) /)
    type = substr(code, 1, RLENGTH)
    sub(/; *$/, "", code)
    count = split(substr(code, length(type) + 1), names, ", ")
    for (i = 1; i <= count; ++i) print (i > 1 && after == "" ? block : "") type names[i] ";" after
  } else {
    print code after
  }
}
NR == 1 && /^\/\// { print "/// @file"; print "///" }
{
  at = match($0, /\/\//)
  indent = match($0, /[^ ]/) - 1
  code = at == 0 ? $0 : substr($0, 1, at - 1)
  text = substr($0, at + 2)
  # Code that is shown inside a comment is indented; Doxygen takes that for what it is.
  is_code = text ~ /^ {4,}/
  starts = last !~ /[,(=]$/
  last = code
  sub(/ +$/, "", last)
}
at == 0 {
  trailing = in_block = 0
  if (indent < 0) block = ""
  if (indent == block_indent && code ~ /^ *}/) in_body = 0
  else if (indent == block_indent && is_ended && !in_body && code !~ /^ *(#|private:|public:)/) printf "%s", block
  print_names(code, "")
  if (code ~ /{$/) in_body = 1
  is_ended = !in_body && code ~ /[;}] *$/
  next
}
code ~ /[^ ]/ || (trailing > 0 && at >= trailing - 2) {
  if (code ~ /[^ ]/) trailing = at
  in_block = 0
  block = ""
  print_names(code, "///<" escaped(text))
  next
}
{
  trailing = is_ended = in_body = 0
  if (!in_block) block = ""
  in_block = 1
  block_indent = indent
  block = block code "///" (is_code ? text : escaped(text)) "\n"
  print code "///" (is_code ? text : escaped(text))
}
