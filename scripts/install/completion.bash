# Completion in bash for trueline and trueline-VERB: verbs, flags, their values and files.
# Verbs are the programs named trueline-* in PATH; flags are those that --help lists.

_trueline_verbs() {
  compgen -c trueline- | sed 's/^trueline-//' | sort -u
}

_trueline_flags() { # PROGRAM
  "$1" --help 2>/dev/null | sed -n 's/^  --\([a-z_]*\) .*(default: \(.*\))$/--\1=/p'
}

_trueline_values() { # FLAG
  case $1 in
  --drive) echo "imu rotors" ;;
  --estimator) echo "vgd vgd_kinematic ekf smoother" ;;
  --thrust) echo "accelerometer level_flight as_published" ;;
  --fit_to) echo "fixes mocap" ;;
  --score) echo e2log ;;
  --report | --quiet | --short | --times | --yaml | --randomise) echo "true false" ;;
  esac
}

_trueline() {
  local word=${COMP_WORDS[COMP_CWORD]} program=${COMP_WORDS[0]} flag=
  [[ $word == = ]] && word=
  if ((COMP_CWORD >= 2)) && [[ ${COMP_WORDS[COMP_CWORD - 1]} == = ]]; then
    flag=${COMP_WORDS[COMP_CWORD - 2]}
  elif ((COMP_CWORD >= 1)) && [[ ${COMP_WORDS[COMP_CWORD]} == = ]]; then
    flag=${COMP_WORDS[COMP_CWORD - 1]}
  fi
  if [[ $program == trueline ]]; then
    if ((COMP_CWORD == 1)); then
      mapfile -t COMPREPLY < <(compgen -W "$(_trueline_verbs) --help --version" -- "$word")
      return
    fi
    program=trueline-${COMP_WORDS[1]}
  fi
  if [[ -n $flag ]]; then
    local values
    values=$(_trueline_values "$flag")
    if [[ -n $values ]]; then
      mapfile -t COMPREPLY < <(compgen -W "$values" -- "$word")
    else
      compopt -o filenames
      mapfile -t COMPREPLY < <(compgen -f -- "$word")
    fi
    return
  fi
  compopt -o nospace
  mapfile -t COMPREPLY < <(compgen -W "$(_trueline_flags "$program") --help" -- "$word")
}

complete -F _trueline trueline
for _trueline_verb in $(_trueline_verbs); do complete -F _trueline "trueline-$_trueline_verb"; done
unset _trueline_verb
