# bash completion for stairwell
_stairwell() {
  local current="${COMP_WORDS[COMP_CWORD]}" previous="${COMP_WORDS[COMP_CWORD-1]}"
  COMPREPLY=()
  case "$previous" in
    --mode) COMPREPLY=($(compgen -W "slice volume" -- "$current")); return ;;
    --planner) COMPREPLY=($(compgen -W "astar theta apf agent2d agent3d slice volume rrtconnect rrtstar informed_rrtstar bitstar abitstar prmstar" -- "$current")); return ;;
    --fallback) COMPREPLY=($(compgen -W "auto none astar theta apf agent2d agent3d slice volume rrtconnect rrtstar informed_rrtstar bitstar abitstar prmstar" -- "$current")); return ;;
    --attraction) COMPREPLY=($(compgen -W "cone geodesic" -- "$current")); return ;;
    --coverage) COMPREPLY=($(compgen -W "layers frontiers kmeans hybrid agent nearest greedy lawnmower random" -- "$current")); return ;;
    --gain) COMPREPLY=($(compgen -W "volume entropy" -- "$current")); return ;;
    --algo) COMPREPLY=($(compgen -W "bc dagger ddpg td3 sac td3bc dqn" -- "$current")); return ;;
    --head) COMPREPLY=($(compgen -W "unit_vector angles" -- "$current")); return ;;
    --device) COMPREPLY=($(compgen -W "cpu cuda" -- "$current")); return ;;
    --sensor) COMPREPLY=($(compgen -W "depth lidar" -- "$current")); return ;;
    --motion) COMPREPLY=($(compgen -W "limited step" -- "$current")); return ;;
    --charge-planning | --noise | --experience | --turn-taking | --close-gaps) COMPREPLY=($(compgen -W "on off" -- "$current")); return ;;
    --modes) COMPREPLY=($(compgen -W "slice,volume slice volume" -- "$current")); return ;;
    --bound) COMPREPLY=($(compgen -W "on off" -- "$current")); return ;;
    --layers) COMPREPLY=($(compgen -W "auto" -- "$current")); return ;;
    --view) COMPREPLY=($(compgen -W "iso top slice: storey:" -- "$current")); return ;;
    --shell) COMPREPLY=($(compgen -W "bash zsh" -- "$current")); return ;;
    --out | --resume) COMPREPLY=($(compgen -d -- "$current")); return ;;
  esac
  if [[ $COMP_CWORD -eq 1 ]]; then
    COMPREPLY=($(compgen -W "explore bound compare plan train evaluate world map report completion man --help --version" -- "$current"))
    return
  fi
  local options=""
  case "${COMP_WORDS[1]}" in
    explore)
      options="--uavs --start --box --mode --planner --fallback --attraction --experience --avoidance --coverage --gain --turn-taking --layers
        --sensor --fov-deg --range --min-range --rate-hz --rays --samples --noise --vmax --amax --jmax --yaw-rate-deg
        --yaw-acc-deg --motion --robot-radius --resolution --seed --time-limit --target-coverage --charge-planning --threads
        --limits --radio-range --start-spread --finish --return --battery-min --lose --stall --extrude-height --point-size --close-gaps
        --voxel-size --config --set --out --resume --json --quiet --help" ;;
    bound)
      options="--uavs --start --start-spread --box --sensor --fov-deg --range --min-range --rate-hz --rays --samples --vmax --amax
        --yaw-rate-deg --yaw-acc-deg --robot-radius --resolution --target-coverage --extrude-height --point-size --close-gaps
        --voxel-size --limits --seed --config --set --rounds --json --quiet --help" ;;
    compare)
      options="--modes --planners --coverage --vary --uavs --seeds --jobs --bound --start --start-spread --box --fallback --avoidance --gain --turn-taking --layers
        --sensor --fov-deg --range --min-range --rate-hz --rays --samples --noise --vmax --amax --jmax --yaw-rate-deg
        --yaw-acc-deg --motion --robot-radius --resolution --time-limit --target-coverage --charge-planning --threads
        --config --set --out --json --quiet --help" ;;
    plan)
      options="--from --to --box --planner --deadline-ms --fallback --attraction --experience --all
        --robot --margin --clearance-weight --slice --benchmark --data --tasks
        --resolution --extrude-height --point-size --close-gaps --voxel-size --out --json --quiet --help" ;;
    train)
      if [[ $COMP_CWORD -eq 2 ]]; then
        COMPREPLY=($(compgen -W "path2d path3d coverage --help" -- "$current"))
        return
      fi
      options="--algo --steps --seed --reward --demonstrations --from --head --attraction --scales --device --out
        --resume --quiet --help" ;;
    evaluate)
      options="--suite --worlds --widest --json --quiet --help" ;;
    world)
      if [[ $COMP_CWORD -eq 2 ]]; then
        COMPREPLY=($(compgen -W "info convert generate --help" -- "$current"))
        return
      fi
      options="--json --resolution --storeys --storey-height --width --depth --seed --help -o --output" ;;
    map)
      if [[ $COMP_CWORD -eq 2 ]]; then
        COMPREPLY=($(compgen -W "info compare convert render --help" -- "$current"))
        return
      fi
      options="--json --view --size --resolution --extrude-height --point-size --close-gaps --voxel-size --help -o --output" ;;
    completion) options="--shell --help" ;;
    report) options="--film --view --size --help" ;;
  esac
  if [[ $current == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$current"))
  else
    COMPREPLY=($(compgen -f -- "$current"))
  fi
}
complete -o filenames -F _stairwell stairwell
