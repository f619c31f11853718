"""Where runs are computed: behind the interface of `concurrent.futures.Executor`."""
