# SPDX-License-Identifier: Apache-2.0
# The manual page (macros of man(7)) of a program from the table that help.awk makes. Variables: version,
# date. The first sentence of the description stands beside the name; lines that begin with two
# spaces are printed as they are.
BEGIN { FS = "\t" }
function escaped(text) {
  gsub(/\\/, "\\e", text)
  gsub(/-/, "\\-", text)
  return text ~ /^[.']/ ? "\\&" text : text
}
function paragraphs(text,   lines, count, i, verbatim, parted, result) {
  count = split(text, lines, "\\\\n")
  for (i = 1; i <= count; ++i) {
    if (lines[i] == "") { parted = result != ""; continue }
    if ((lines[i] ~ /^  /) != verbatim) {
      verbatim = !verbatim
      result = result (verbatim ? ".PP\n.nf\n" : ".fi\n.PP\n")
    } else if (parted && !verbatim) {
      result = result ".PP\n"
    }
    parted = 0
    result = result escaped(lines[i]) "\n"
  }
  return result (verbatim ? ".fi\n" : "")
}
function summary(name, text) {
  sub(/\\n\\n.*/, "", text)
  gsub(/\\n/, " ", text)
  sub(/\. .*/, "", text)
  sub(/[.:]$/, "", text)
  if (index(text, name ": ") == 1) text = substr(text, length(name) + 3)
  return tolower(substr(text, 1, 1)) substr(text, 2)
}
# The synopsis needs the arguments, which follow it: each part is printed when it is complete.
function finish() {
  if (part == "program") {
    printf ".B %s\n[OPTIONS]%s%s\n.SH DESCRIPTION\n%s.SH OPTIONS\n%s", escaped(name), \
           arguments, ($1 == "command" ? " COMMAND" : ""), paragraphs(description), options
  } else if (part == "command") {
    if (!commanded++) print ".SH COMMANDS"
    printf ".SS %s [OPTIONS]%s\n%s%s", escaped(name), arguments, paragraphs(description), options
  }
  arguments = options = ""
}
$1 == "program" || $1 == "command" { finish(); part = $1; name = $2; description = $3 }
$1 == "program" {
  page = name
  gsub(/ /, "-", page)
  printf ".TH %s 1 %s \"drapebench %s\" \"drapebench manual\"\n.SH NAME\n%s \\- %s\n.SH SYNOPSIS\n", \
         escaped(toupper(page)), date, version, escaped(page), escaped(summary(name, description))
}
$1 == "option" {
  if ($5 ~ /positional/) arguments = arguments ($5 ~ /required/ ? " " $2 : " [" $2 "]")
  options = options ".TP\n\\fB" escaped($2) "\\fR" ($3 == "" ? "" : " \\fI" escaped($3) "\\fR") "\n" \
            ($6 == "" ? "\\&" : escaped($6)) ($5 ~ /required/ ? " (required)" : "") \
            ($4 == "" ? "" : " (default: " escaped($4) ")") "\n"
}
END {
  finish()
  print ".SH EXIT STATUS"
  count = split("0;good;1;it ran, and its verdict is NO-GO;2;wrong use;3;bad input;4;a device failed;" \
                "5;internal error;130;interrupted, what was finished is kept", codes, ";")
  for (i = 1; i < count; i += 2) printf ".TP\n%s\n%s\n", codes[i], escaped(codes[i + 1])
  if (page != "drape") print ".SH SEE ALSO\n.BR drape (1)"
}
