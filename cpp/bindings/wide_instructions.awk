# Reads the disassembly of the module; names the functions with instructions of AVX or later that
# any processor may come to. Those of wide_<set>.cpp carry the set in their name, or are copies that
# the compiler made for that file alone (a suffix with a dot).
/^[0-9a-f]+ <.*>:$/ {
  name = $2
  allowed = name ~ /avx|InstructionSet|\./
  next
}
!allowed && $2 ~ /^v[a-z]/ && $2 !~ /^ver[rw]$/ {
  print substr(name, 2, length(name) - 3)
  allowed = 1
}
