"""What shells read so as to complete command lines. Each script asks callboard what could come next."""

from __future__ import annotations

from typing import Final

_BASH: Final = r"""# bash completion for callboard
_callboard() {
    local current word kept="" line="${COMP_LINE:0:COMP_POINT}"
    current="${line##*[[:space:]]}"
    # readline takes : and = for ends of words, and completes only what follows them
    case "$current" in
        *[:=]*)
            word="${current##*[:=]}"
            kept="${current%"$word"}"
            [[ $kept == *:* && $COMP_WORDBREAKS != *:* ]] && kept=""
            [[ $kept == *=* && $COMP_WORDBREAKS != *=* ]] && kept=""
            ;;
    esac
    COMPREPLY=()
    while IFS= read -r word; do
        word="${word%%$'\t'*}"
        if [[ $word == :files: ]]; then
            compopt -o default 2>/dev/null
        else
            COMPREPLY+=("${word#"$kept"}")
        fi
    done < <(command "${COMP_WORDS[0]/#\~/$HOME}" completion bash --line "$line" 2>/dev/null)
}
complete -F _callboard callboard
"""

_ZSH: Final = r"""#compdef callboard
_callboard() {
    local -a offers
    local word about files=""
    while IFS=$'\t' read -r word about; do
        if [[ $word == :files: ]]; then
            files=yes
        else
            offers+=("${word//:/\\:}${about:+:$about}")
        fi
    done < <(command "${words[1]/#\~/$HOME}" completion zsh --words \
        "${(@Q)words[2,CURRENT-1]}" "${(Q)PREFIX}" 2>/dev/null)
    (( $#offers )) && _describe -t callboard callboard offers
    [[ -n $files ]] && _files
    return 0
}
if [[ ${funcstack[1]} == _callboard ]]; then
    _callboard "$@"
else
    compdef _callboard callboard
fi
"""

_FISH: Final = r"""# fish completion for callboard
function __callboard_offers
    set -l words (commandline -opc)
    set -l current (commandline -ct)
    set -l name $words[1]
    set -e words[1]
    for line in (command $name completion fish --words $words "$current" 2>/dev/null)
        if test "$line" = ":files:"
            __fish_complete_path "$current"
        else
            echo $line
        end
    end
end
complete -c callboard -f -a "(__callboard_offers)"
"""

SCRIPTS: Final = {"bash": _BASH, "zsh": _ZSH, "fish": _FISH}
