# fish completion for callboard
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
