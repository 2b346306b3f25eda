# SPDX-License-Identifier: Apache-2.0
# The text of --help as a table for manual.awk and completion.bash, with tabs between fields: `kind`
# ("program" or "command"), `name`, description with \n between its lines; then each option as
# "option", names, value (empty: a flag), default, "positional" and "required", text.
function flush_option(  rest, value, usual, flags) {
  if (left == "") return
  rest = left
  sub(/^[^ ]+ */, "", rest)
  sub(/ .*/, "", left)
  sub(/\{false\}$/, "", left)  # a flag that switches off
  flags = positional ? "positional " : ""
  if (sub(/ *REQUIRED */, " ", rest)) flags = flags "required"
  sub(/ *\.\.\. *$/, "", rest)
  sub(/ +$/, "", rest)
  # "TEXT:{a,b}=a", "INT:INT in [0 - 9]=3", "FLOAT=0.5"
  if (match(rest, /=[^=]*$/)) { usual = substr(rest, RSTART + 1); rest = substr(rest, 1, RSTART - 1) }
  value = rest
  sub(/^[A-Z]+:/, "", value)
  options = options "option\t" left "\t" value "\t" usual "\t" flags "\t" text "\n"
  left = text = ""
}
{ sub(/[ \t]+$/, "") }
/^Usage:/ { part = "usage"; next }
/^Positionals:/ { part = "options"; positional = 1; next }
/^Options:/ { flush_option(); part = "options"; positional = 0; next }
/^Subcommands:/ { flush_option(); part = "subcommands"; next }
part == "options" && /^                              [^ ]/ {
  # The text stands on a line of its own where the names were long.
  if (whole != "") left = whole
  text = substr($0, 31)
  whole = ""
  next
}
part == "options" && /^  [^ ]/ {
  flush_option()
  whole = substr($0, 3)
  left = substr($0, 3, 28)
  sub(/ +$/, "", left)
  text = substr($0, 31)
  next
}
part == "options" && $0 == "" { flush_option(); next }
part == "" || (part != "usage" && part != "subcommands" && !/^ /) {
  flush_option()
  description = description (description == "" ? "" : "\\n") $0
}
END {
  flush_option()
  sub(/(\\n)+$/, "", description)
  printf "%s\t%s\t%s\n%s", kind, name, description, options
}
